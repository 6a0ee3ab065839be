//! Typed arrays out of buffers (glTF 2.0, section 3.6.2), with every bound checked.

use super::{Document, Read, get};
use ::gltf::json;
use json::accessor::{Accessor, ComponentType, Type};
use json::validation::Checked;

type Index = json::Index<Accessor>;

fn is_finite(values: &[f32]) -> bool {
    values.iter().all(|v| v.is_finite())
}

/// An accessor's elements, tightly packed, sparse substitution done.
pub(super) struct Packed {
    pub bytes: Vec<u8>,
    pub component: ComponentType,
    pub normalized: bool,
}

impl Document<'_> {
    /// Number of elements of an accessor.
    pub(super) fn count(&self, index: Index, what: &str) -> Read<usize> {
        let accessor = get(&self.root.accessors, index, "accessor")?;
        usize::try_from(accessor.count.0).map_err(|_| format!("{what} has an absurd count"))
    }

    /// Elements of `N` floating-point numbers; integers are converted, and scaled where the
    /// accessor is normalized. All are finite.
    pub(super) fn floats<const N: usize>(&self, index: Index, what: &str) -> Read<Vec<[f32; N]>> {
        let values = self.numbers::<N>(index, what)?;
        match values.iter().position(|v| !is_finite(v)) {
            Some(at) => Err(format!(
                "{what} holds a number that is not finite, at element {at}"
            )),
            None => Ok(values),
        }
    }

    /// As [`Document::floats`], but elements that are not finite become `stand_in`, with a warning.
    pub(super) fn floats_or<const N: usize>(
        &self,
        index: Index,
        what: &str,
        stand_in: [f32; N],
    ) -> Read<Vec<[f32; N]>> {
        let mut values = self.numbers::<N>(index, what)?;
        let mut wrong = 0;
        for value in values.iter_mut().filter(|v| !is_finite(&v[..])) {
            *value = stand_in;
            wrong += 1;
        }
        if wrong > 0 {
            self.warn(format!(
                "{what} holds numbers that are not finite; {wrong} of {} elements were left out",
                values.len()
            ));
        }
        Ok(values)
    }

    /// Elements of `N` floating-point numbers, finite or not.
    pub(super) fn numbers<const N: usize>(&self, index: Index, what: &str) -> Read<Vec<[f32; N]>> {
        let packed = self.packed(index, N, what)?;
        let size = packed.component.size();
        let scale = match (packed.normalized, packed.component) {
            (false, _) | (true, ComponentType::F32 | ComponentType::U32) => None,
            (true, ComponentType::I8) => Some(f32::from(i8::MAX)),
            (true, ComponentType::U8) => Some(f32::from(u8::MAX)),
            (true, ComponentType::I16) => Some(f32::from(i16::MAX)),
            (true, ComponentType::U16) => Some(f32::from(u16::MAX)),
        };
        let number = |b: &[u8]| -> f32 {
            let value = match (packed.component, b) {
                (ComponentType::I8, &[a]) => f32::from(a as i8),
                (ComponentType::U8, &[a]) => f32::from(a),
                (ComponentType::I16, &[a, b]) => f32::from(i16::from_le_bytes([a, b])),
                (ComponentType::U16, &[a, b]) => f32::from(u16::from_le_bytes([a, b])),
                (ComponentType::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]) as f32,
                (ComponentType::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
                _ => 0.0,
            };
            match scale {
                // The most negative integer stands for -1, too.
                Some(scale) => (value / scale).max(-1.0),
                None => value,
            }
        };
        let mut out = Vec::with_capacity(packed.bytes.len() / (size * N));
        for element in packed.bytes.chunks_exact(size * N) {
            let mut values = [0.0; N];
            for (value, bytes) in values.iter_mut().zip(element.chunks_exact(size)) {
                *value = number(bytes);
            }
            out.push(values);
        }
        Ok(out)
    }

    /// Elements of `N` unsigned integers.
    pub(super) fn integers<const N: usize>(&self, index: Index, what: &str) -> Read<Vec<[u32; N]>> {
        let packed = self.packed(index, N, what)?;
        let size = packed.component.size();
        let number = |b: &[u8]| match *b {
            [a] => u32::from(a),
            [a, b] => u32::from(u16::from_le_bytes([a, b])),
            [a, b, c, d] => u32::from_le_bytes([a, b, c, d]),
            _ => 0,
        };
        if !matches!(
            packed.component,
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32
        ) {
            return Err(format!("{what} is not of an unsigned integer type"));
        }
        Ok(packed
            .bytes
            .chunks_exact(size * N)
            .map(|element| {
                let mut values = [0; N];
                for (value, bytes) in values.iter_mut().zip(element.chunks_exact(size)) {
                    *value = number(bytes);
                }
                values
            })
            .collect())
    }

    pub(super) fn packed(&self, index: Index, components: usize, what: &str) -> Read<Packed> {
        let accessor = get(&self.root.accessors, index, "accessor")?;
        let place = format!("{what} (accessor {})", index.value());
        let Checked::Valid(component) = &accessor.component_type else {
            return Err(format!("{place} has an unknown component type"));
        };
        let Checked::Valid(kind) = &accessor.type_ else {
            return Err(format!("{place} has an unknown type"));
        };
        let has = match kind {
            Type::Scalar => 1,
            Type::Vec2 => 2,
            Type::Vec3 => 3,
            Type::Vec4 | Type::Mat2 => 4,
            Type::Mat3 => 9,
            Type::Mat4 => 16,
        };
        if has != components {
            return Err(format!(
                "{place} has {has} components an element, {components} are needed"
            ));
        }
        let component = component.0;
        let size = component.size() * components;
        let count = usize::try_from(accessor.count.0).unwrap_or(usize::MAX);
        let mut bytes = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |o| o.0);
                self.gather(view, offset, size, count, &place)?
            }
            None => {
                // Zeros that cost the file nothing.
                self.spend(count, &place)?;
                let length = count.checked_mul(size);
                vec![0; length.ok_or_else(|| format!("{place} has an absurd count"))?]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let changed = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
            if changed > count {
                return Err(format!("{place} replaces more elements than it has"));
            }
            let Checked::Valid(index_type) = &sparse.indices.component_type else {
                return Err(format!("{place} has an unknown sparse index type"));
            };
            let index_size = index_type.0.size();
            let indices = self.gather(
                sparse.indices.buffer_view,
                sparse.indices.byte_offset.0,
                index_size,
                changed,
                &place,
            )?;
            let values = self.gather(
                sparse.values.buffer_view,
                sparse.values.byte_offset.0,
                size,
                changed,
                &place,
            )?;
            let pairs = indices
                .chunks_exact(index_size)
                .zip(values.chunks_exact(size));
            for (index, value) in pairs {
                let mut wide = [0; 8];
                wide[..index.len()].copy_from_slice(index);
                let at = u64::from_le_bytes(wide) as usize;
                match bytes.chunks_exact_mut(size).nth(at) {
                    Some(slot) => slot.copy_from_slice(value),
                    None => return Err(format!("{place} has a sparse index out of range")),
                }
            }
        }
        Ok(Packed {
            bytes,
            component,
            normalized: accessor.normalized,
        })
    }

    /// Copies `count` elements of `size` bytes out of a buffer view.
    fn gather(
        &self,
        view: json::Index<json::buffer::View>,
        offset: u64,
        size: usize,
        count: usize,
        place: &str,
    ) -> Read<Vec<u8>> {
        let (bytes, stride) = self.view(view)?;
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(format!(
                "{place} has a stride of {stride} bytes for elements of {size}"
            ));
        }
        let offset = usize::try_from(offset).unwrap_or(usize::MAX);
        let reach = match count {
            0 => Some(0),
            _ => (count - 1)
                .checked_mul(stride)
                .and_then(|n| n.checked_add(size)),
        };
        let data = reach
            .and_then(|reach| offset.checked_add(reach))
            .and_then(|end| bytes.get(offset..end))
            .ok_or_else(|| {
                format!(
                    "{place} reaches beyond its buffer view {}, which has {} bytes",
                    view.value(),
                    bytes.len()
                )
            })?;
        if stride == size {
            return Ok(data.to_vec());
        }
        let mut out = Vec::with_capacity(count * size);
        for element in data.chunks(stride) {
            out.extend_from_slice(&element[..size]);
        }
        Ok(out)
    }
}
