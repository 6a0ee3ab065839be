//! Volumes of probes: drawn from an input, and the rules that they keep.

use arbitrary::{Result, Unstructured};
use dapple_codec::probes::{
    CODES, Coding, Probe, State, Steps, TEXELS, Visibility, Volume, f32_from_f16,
};
use dapple_codec::{LiveTrack, Transform};

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
    let spacing = f32::from(u.int_in_range(1u8..=9)?) / 8.0;
    Ok(Volume {
        grid_from_mesh: Transform::IDENTITY.world_from_grid,
        dims,
        spacing: [spacing, spacing, 1.0],
        exponent: u.int_in_range(-64..=64)?,
        visibility: Visibility {
            side,
            range: if side > 0 { spacing * 9.0 } else { 0.0 },
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

/// What a volume counts (B-006).
pub fn state_bytes(volume: &Volume) -> u64 {
    let side = u64::from(volume.visibility.side);
    volume.count() as u64 * (184 + 2 * side * side)
}

/// What holds of a committed volume (`spec/probes.md` §5 to §10).
pub fn check(state: &State, live: &LiveTrack, volume: &Volume) {
    let (probes, texels) = (state.probes_of(live), state.texels_of(live));
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
    if let Some(bytes) = state.visibility_of(live) {
        assert_eq!(bytes.len() as u64, volume.visibility_bytes());
    }
}
