//! Axis-aligned boxes.

use glam::{Affine3A, Vec3};

/// An axis-aligned box. Empty when `min > max` on any axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    pub min: Vec3,
    pub max: Vec3,
}

impl Aabb {
    /// The box of nothing, neutral under [`Aabb::union`].
    pub const EMPTY: Aabb = Aabb {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// The box of some points.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Aabb {
        points
            .into_iter()
            .fold(Aabb::EMPTY, |b, p| b.union(&Aabb { min: p, max: p }))
    }

    pub fn centre(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    /// Radius of the sphere about the centre that holds the box.
    pub fn radius(&self) -> f32 {
        0.5 * (self.max - self.min).length()
    }

    /// Squared distance to another box: 0 where they overlap, infinite if one is empty.
    pub fn gap_squared(&self, other: &Aabb) -> f32 {
        (self.min - other.max)
            .max(other.min - self.max)
            .max(Vec3::ZERO)
            .length_squared()
    }

    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// The box widened by `by` on all six sides; an empty box stays empty.
    pub fn grown(&self, by: f32) -> Aabb {
        if self.is_empty() {
            return *self;
        }
        Aabb {
            min: self.min - by,
            max: self.max + by,
        }
    }

    pub fn overlaps(&self, other: &Aabb) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Half the surface area; 0 when empty.
    pub fn half_area(&self) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        let e = self.max - self.min;
        e.x * e.y + e.y * e.z + e.z * e.x
    }

    /// Squared distance from `point` to the box: 0 inside, infinite for an empty box.
    pub fn distance_squared(&self, point: Vec3) -> f32 {
        (self.min - point)
            .max(point - self.max)
            .max(Vec3::ZERO)
            .length_squared()
    }

    /// The largest absolute coordinate; 0 when empty.
    pub fn reach(&self) -> f32 {
        if self.is_empty() {
            0.0
        } else {
            self.min.abs().max(self.max.abs()).max_element()
        }
    }

    /// The box of the box's image under `transform` (Arvo 1990, *Transforming Axis-Aligned
    /// Bounding Boxes*).
    pub fn transformed(&self, transform: &Affine3A) -> Aabb {
        if self.is_empty() {
            return *self;
        }
        let centre = transform.transform_point3(0.5 * (self.min + self.max));
        let half = 0.5 * (self.max - self.min);
        let m = transform.matrix3;
        let half =
            Vec3::from(m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z);
        Aabb {
            min: centre - half,
            max: centre + half,
        }
    }
}
