//! `probes`: volumes, drawn from an input, and the rules that they keep.

use arbitrary::{Result, Unstructured};
use dapple_codec::container::HEADER_BYTES;
use dapple_codec::probes::{
    CODES, Coding, Coverage, Probe, State, Steps, TEXELS, Update, Visibility, Volume, f32_from_f16,
};
use dapple_codec::{Compression, Decoder, Encoder, EncoderConfig, GroupStart, Model, TrackState};

use super::{TrackContent, in_records};
use crate::records::{matrix_and_dims, put, some};
use crate::server::{compression, matrix};

/// Small enough that eight of them with all their content fit into a record.
pub fn volume(u: &mut Unstructured<'_>) -> Result<Volume> {
    let dims = match u.int_in_range(0..=9)? {
        0 => [1, 1, 64],
        1 => [64, 1, 1],
        2 => [1, 1, 1],
        _ => [
            u.int_in_range(1..=3)?,
            u.int_in_range(1..=3)?,
            u.int_in_range(1..=3)?,
        ],
    };
    let small = dims.iter().all(|&d| d <= 2);
    let side = match u.int_in_range(0..=5)? {
        3 => 4,
        4 if dims.iter().all(|&d| d <= 3) => 8,
        5 if small => 16,
        _ => 0,
    };
    let coding = match u.ratio(1, 3)? {
        true => Coding::Raw,
        false => Coding::Packed(Steps {
            luma: [
                u.int_in_range(1..=2560)?,
                u.int_in_range(1..=32768)?,
                u.int_in_range(1..=32768)?,
            ],
            chroma: [
                u.int_in_range(1..=32768)?,
                u.int_in_range(1..=600)?,
                u.int_in_range(1..=600)?,
            ],
        }),
    };
    let steps = match coding {
        Coding::Packed(_) if side > 0 => [u.int_in_range(1..=255)?, u.int_in_range(1..=255)?],
        _ => [0; 2],
    };
    let spacing = f32::from(u.int_in_range(1u8..=9)?) / 8.0;
    Ok(Volume {
        grid_from_mesh: matrix(u)?,
        dims,
        spacing: [spacing, spacing, 1.0],
        exponent: u.int_in_range(-64..=64)?,
        visibility: Visibility {
            side,
            range: if side > 0 { spacing * 9.0 } else { 0.0 },
            steps,
        },
        coding,
    })
}

/// A probe that may be in a volume.
pub fn probe(u: &mut Unstructured<'_>, volume: &Volume) -> Result<Probe> {
    if u.ratio(1, 6)? {
        return Ok(Probe::ABSENT);
    }
    let level = match volume.coding {
        Coding::Raw => 3,
        Coding::Packed(_) => u.int_in_range(1..=3)?,
    };
    let mut probe = Probe {
        level,
        ..Probe::ABSENT
    };
    for code in 0..used(level) {
        probe.codes[code] = self::code(u, volume, code)?;
    }
    Ok(probe)
}

/// A code that may stand at a place.
pub fn code(u: &mut Unstructured<'_>, volume: &Volume, code: usize) -> Result<i16> {
    Ok(match limits(volume, code) {
        // Finite; those of degree 0 above 0.
        None if code < 3 => u.int_in_range(0..=0x7bff)?,
        None => {
            let bits: u16 = u.int_in_range(0..=0x7bff)?;
            (bits | if u.arbitrary()? { 0x8000 } else { 0 }) as i16
        }
        // Near 0 more often than not.
        Some((least, most)) => match u.ratio(3, 4)? {
            true => i16::from(u.int_in_range(-9i8..=9)?).clamp(least, most),
            false => u.int_in_range(least..=most)?,
        },
    })
}

/// A visibility block.
pub fn visibility(u: &mut Unstructured<'_>, volume: &Volume) -> Result<Vec<u8>> {
    let fill: u8 = u.arbitrary()?;
    let mut bytes = vec![fill; volume.visibility_bytes() as usize];
    if !bytes.is_empty() {
        let at = u.choose_index(bytes.len())?;
        bytes[at] = u.arbitrary()?;
    }
    if let Coding::Packed(_) = volume.coding {
        volume.quantize_visibility(&mut bytes);
    }
    Ok(bytes)
}

/// Codes of a level.
pub fn used(level: u8) -> usize {
    [0, 3, 12, 27][usize::from(level)]
}

/// Least and largest code at a place, where the volume is packed (B-042).
fn limits(volume: &Volume, code: usize) -> Option<(i16, i16)> {
    let Coding::Packed(steps) = volume.coding else {
        return None;
    };
    let step = i32::from(match code {
        0 => steps.luma[0],
        1..3 => steps.chroma[0],
        3..6 => steps.luma[1],
        6..12 => steps.chroma[1],
        12..17 => steps.luma[2],
        _ => steps.chroma[2],
    });
    if code == 0 {
        return Some((0, (10_239 / step) as i16));
    }
    let most = 32_768 / step;
    Some(((-most) as i16, most.min(32_767) as i16))
}

/// Number of the coding.
pub fn coding(volume: &Volume) -> u16 {
    match volume.coding {
        Coding::Raw => 0,
        Coding::Packed(_) => 1,
    }
}

/// Parameters as bytes, with `scale` times as many probes.
pub fn parameters(volume: &Volume, scale: u32) -> Vec<u8> {
    let [dx, dy, dz] = volume.dims;
    let mut bytes = matrix_and_dims(
        &volume.grid_from_mesh,
        [dx, dy, dz.saturating_mul(scale as u16)],
    );
    put(&mut bytes, &volume.spacing.map(f32::to_bits));
    let visibility = volume.visibility;
    bytes.extend([volume.exponent as u8, visibility.side]);
    bytes.extend(visibility.steps);
    put(&mut bytes, &[visibility.range.to_bits()]);
    let steps = match volume.coding {
        Coding::Raw => [0; 6],
        Coding::Packed(steps) => {
            let ([y0, y1, y2], [c0, c1, c2]) = (steps.luma, steps.chroma);
            [y0, c0, y1, c1, y2, c2]
        }
    };
    bytes.extend(steps.iter().flat_map(|step| step.to_le_bytes()));
    bytes
}

/// Probes and visibility of a track. Equal where those are, whatever was committed before.
#[derive(Clone, Debug)]
pub struct Content {
    /// All probes.
    pub probes: Vec<Probe>,
    /// The visibility block.
    pub visibility: Option<Vec<u8>>,
    /// The probes of the last frame.
    committed: Vec<Probe>,
}

impl PartialEq for Content {
    fn eq(&self, other: &Content) -> bool {
        self.probes == other.probes && self.visibility == other.visibility
    }
}

impl Content {
    /// Of a new track.
    pub fn empty(volume: &Volume) -> Content {
        let probes = vec![Probe::ABSENT; volume.count()];
        Content {
            committed: probes.clone(),
            probes,
            visibility: None,
        }
    }

    /// What a decoder shows.
    pub fn shown(state: &State, track: &TrackState) -> Content {
        let probes = state.probes_of(track).to_vec();
        Content {
            committed: probes.clone(),
            probes,
            visibility: state.visibility_of(track).map(<[u8]>::to_vec),
        }
    }

    /// Changes probes here and there, and the visibility. Returns the block, where it is sent.
    fn change(
        &mut self,
        u: &mut Unstructured<'_>,
        volume: &Volume,
        keyframe: bool,
    ) -> Result<Option<Vec<u8>>> {
        for _ in 0..u.int_in_range(0..=6)? {
            let at = u.choose_index(self.probes.len())?;
            let probe = &mut self.probes[at];
            if probe.level == 0 || u.arbitrary()? {
                *probe = self::probe(u, volume)?;
            } else {
                let code = u.choose_index(used(probe.level))?;
                probe.codes[code] = self::code(u, volume, code)?;
            }
        }
        let sent = volume.visibility.side > 0 && u.ratio(1, 3)?;
        let visibility = match sent {
            true => Some(self::visibility(u, volume)?),
            false => None,
        };
        if keyframe || sent {
            self.visibility.clone_from(&visibility);
        }
        Ok(visibility)
    }
}

/// Changes tracks and writes them ([`super::write`]).
pub fn write(
    u: &mut Unstructured<'_>,
    tracks: Vec<TrackContent<'_>>,
    encoder: &mut Encoder,
    out: &mut Vec<u8>,
) -> Result<()> {
    let (mut full, mut partial) = (Vec::new(), Vec::new());
    for track in tracks {
        let (Model::Probes(volume), super::Content::Probes(content)) = (track.model, track.content)
        else {
            continue;
        };
        let visibility = content.change(u, &volume, track.keyframe)?;
        let base = std::mem::replace(&mut content.committed, content.probes.clone());
        let into = if track.keyframe {
            &mut full
        } else {
            &mut partial
        };
        into.push((track.id, base, &content.probes, visibility));
    }
    for (coverage, contents) in [(Coverage::Keyframe, full), (Coverage::Delta, partial)] {
        in_records(u, &contents, |u, contents| {
            let updates: Vec<_> = contents
                .iter()
                .map(|(track, base, probes, visibility)| Update {
                    track: *track,
                    base,
                    probes,
                    visibility: visibility.as_deref(),
                })
                .collect();
            let written = encoder.probes(out, coverage, &updates, compression(u)?);
            written.expect("probes");
            Ok(())
        })?;
    }
    Ok(())
}

/// Some volumes with some probes changed, by the encoder.
pub fn payload(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let ids = some(u, decoder)?;
    let last = decoder.last_frame().map(|(frame, _)| frame);
    let keyframe = last.is_none() || u.ratio(1, 2)?;
    let named = decoder.tracks().iter();
    let named: Vec<_> = named
        .filter(|track| track.track.volume().is_some() && ids.contains(&track.track.id))
        .collect();
    let mut contents = Vec::new();
    for track in &named {
        let volume = track.track.volume().expect("probes");
        let base = decoder.probes().probes_of(track);
        let mut probes = match keyframe {
            true => vec![Probe::ABSENT; base.len()],
            false => base.to_vec(),
        };
        for _ in 0..u.int_in_range(0..=8)? {
            let at = u.choose_index(probes.len())?;
            probes[at] = probe(u, volume)?;
        }
        let visibility = match volume.visibility.side > 0 && u.ratio(1, 3)? {
            true => Some(visibility(u, volume)?),
            false => None,
        };
        contents.push((track.track.id, base, probes, visibility));
    }
    if contents.is_empty() {
        let mut payload = Vec::new();
        let base = if keyframe { 0 } else { last.unwrap_or(0) };
        put(&mut payload, &[0, keyframe.into(), base, 0]);
        return Ok(payload);
    }
    // A stream of its own, whose last record is the one that is wanted.
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).expect("preamble");
    let tracks: Vec<_> = named.iter().map(|track| track.track.clone()).collect();
    encoder.tracks(&mut bytes, &tracks).expect("tracks");
    let start = GroupStart::Keyframes;
    encoder.group(&mut bytes, start).expect("group");
    // The frame that a delta builds on.
    let bases: Vec<_> = contents
        .iter()
        .map(|(track, base, ..)| Update {
            track: *track,
            base: &[],
            probes: base,
            visibility: named
                .iter()
                .find(|named| named.track.id == *track)
                .and_then(|named| decoder.probes().visibility_of(named)),
        })
        .collect();
    let written = encoder.probes(&mut bytes, Coverage::Keyframe, &bases, Compression::None);
    written.expect("base");
    encoder.commit(&mut bytes, 0, None).expect("commit");
    let updates: Vec<_> = contents
        .iter()
        .map(|(track, base, probes, visibility)| Update {
            track: *track,
            base,
            probes,
            visibility: visibility.as_deref(),
        })
        .collect();
    let coverage = match keyframe {
        true => Coverage::Keyframe,
        false => Coverage::Delta,
    };
    let at = bytes.len() + HEADER_BYTES;
    let written = encoder.probes(&mut bytes, coverage, &updates, Compression::None);
    written.expect("probes");
    let mut payload = bytes.split_off(at);
    if !keyframe {
        payload[8..12].copy_from_slice(&last.unwrap_or(0).to_le_bytes());
    }
    // Any bit of it, the coder's among them.
    if !payload.is_empty() && u.ratio(1, 8)? {
        let at = u.choose_index(payload.len())?;
        payload[at] ^= 1 << u.int_in_range(0..=7)?;
    }
    Ok(payload)
}

/// What a volume counts (B-006).
fn state_bytes(volume: &Volume) -> u64 {
    let side = u64::from(volume.visibility.side);
    let copies = match volume.coding {
        Coding::Raw => 1,
        Coding::Packed(_) => 2,
    };
    volume.count() as u64 * (184 + copies * 2 * side * side)
}

/// What holds of the committed state (`spec/probes.md` §5 to §10).
pub fn check(decoder: &Decoder) -> u64 {
    let mut bytes = 0;
    for track in decoder.tracks() {
        if let Some(volume) = track.track.volume() {
            check_track(decoder.probes(), track, volume);
            bytes += state_bytes(volume);
        }
    }
    bytes
}

fn check_track(state: &State, track: &TrackState, volume: &Volume) {
    let (probes, texels) = (state.probes_of(track), state.texels_of(track));
    let count = volume.count();
    assert_eq!(probes.len(), count);
    assert_eq!(texels.len(), TEXELS * count);
    let absent = probes.iter().all(|probe| probe.level == 0);
    for (index, probe) in probes.iter().enumerate() {
        let levels: &[u8] = match volume.coding {
            Coding::Raw => &[0, 3],
            Coding::Packed(_) => &[0, 1, 2, 3],
        };
        assert!(levels.contains(&probe.level));
        assert!(probe.codes[used(probe.level)..].iter().all(|&c| c == 0));
        for (code, &value) in probe.codes.iter().enumerate() {
            if let Some((least, most)) = limits(volume, code) {
                assert!((least..=most).contains(&value), "code {code}: {value}");
            }
        }
        let shown: Vec<u16> = (0..28)
            .map(|v| texels[v / 4 * count + index][v % 4])
            .collect();
        assert_eq!(shown[CODES], 0);
        assert!(shown.iter().all(|&bits| f32_from_f16(bits).is_finite()));
        assert!(shown[..3].iter().all(|&bits| f32_from_f16(bits) >= 0.0));
        if probe.level > 0 {
            assert_eq!(shown[..CODES], volume.values(probe));
        }
        assert!(!absent || shown.iter().all(|&bits| bits == 0));
    }
    if let Some(bytes) = state.visibility_of(track) {
        assert_eq!(bytes.len() as u64, volume.visibility_bytes());
        if let Coding::Packed(_) = volume.coding {
            let mut rounded = bytes.to_vec();
            volume.quantize_visibility(&mut rounded);
            assert_eq!(rounded, bytes, "bytes of map codes");
        }
    }
}
