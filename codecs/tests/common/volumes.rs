//! A small server of volumes: probes that change at random.
#![allow(dead_code)]

use crate::common::Random;
use dapple_codec::probes::*;
use dapple_codec::*;

pub const STEPS: Steps = Steps {
    luma: [8, 100, 200],
    chroma: [80, 120, 240],
};

/// Steps of means and deviations in maps.
pub const MAP_STEPS: [u8; 2] = [3, 20];

pub fn volume(dims: [u16; 3], side: u8, coding: Coding) -> Volume {
    Volume {
        grid_from_mesh: [
            [1.0, 0.0, 0.0, 1.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 1.0],
        ],
        dims,
        spacing: [1.0, 0.5, 2.0],
        exponent: -3,
        visibility: Visibility {
            side,
            range: if side > 0 { 7.5 } else { 0.0 },
            steps: match coding {
                Coding::Packed(_) if side > 0 => MAP_STEPS,
                _ => [0; 2],
            },
        },
        coding,
    }
}

pub fn volume_track(id: u32, volume: Volume) -> Track {
    Track {
        id,
        target: Target {
            application_id: 3,
            path: format!("volume{id}"),
            content_hash: None,
        },
        aabb_min: [0.0; 3],
        aabb_max: [4.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Probes(volume),
    }
}

/// One volume as a server keeps it.
#[derive(Clone)]
pub struct VolumeFixture {
    pub track: Track,
    pub volume: Volume,
    pub base: Vec<Probe>,
    pub probes: Vec<Probe>,
    pub visibility: Option<Vec<u8>>,
    pub send_visibility: bool,
}

impl VolumeFixture {
    pub fn new(id: u32, volume: Volume) -> VolumeFixture {
        VolumeFixture {
            track: volume_track(id, volume),
            volume,
            base: vec![Probe::ABSENT; volume.count()],
            probes: vec![Probe::ABSENT; volume.count()],
            visibility: None,
            send_visibility: false,
        }
    }

    /// Changes one in `every` probes: whole new ones, some codes, levels, and absent ones.
    pub fn change(&mut self, random: &mut Random, every: u32) {
        self.base.clone_from(&self.probes);
        for probe in &mut self.probes {
            if random.below(every) > 0 {
                continue;
            }
            *probe = match (random.below(4), self.volume.coding) {
                (0, _) => Probe::ABSENT,
                (_, Coding::Raw) => raw_probe(random),
                (1, Coding::Packed(steps)) => packed_probe(random, &steps),
                (_, Coding::Packed(steps)) => nudged(*probe, random, &steps),
            };
        }
        self.send_visibility = self.volume.visibility.side > 0 && random.below(3) == 0;
        if self.send_visibility {
            self.change_visibility(random);
        }
    }

    /// Changes maps: all of them at random, or few, smoothly or texel by texel.
    fn change_visibility(&mut self, random: &mut Random) {
        let size = self.volume.visibility_bytes() as usize;
        let map_bytes = size / self.volume.count();
        let open = || [255, 0].repeat(size / 2);
        let mut block = self.visibility.take().unwrap_or_else(open);
        if random.below(3) == 0 {
            block.fill_with(|| random.next() as u8);
        }
        for map in block.chunks_mut(map_bytes) {
            let (base, slope) = (random.below(256), random.below(9));
            let deviates = random.below(3) == 0;
            match random.below(6) {
                0 => map.copy_from_slice(&[255, 0].repeat(map_bytes / 2)),
                1 => {
                    for (at, texel) in (0..).zip(map.as_chunks_mut::<2>().0) {
                        let deviation = if deviates { random.next() as u8 / 4 } else { 0 };
                        *texel = [(base + slope * at).min(255) as u8, deviation];
                    }
                }
                2 => map[random.below(map_bytes as u32) as usize] = random.next() as u8,
                _ => {}
            }
        }
        if let Coding::Packed(_) = self.volume.coding {
            self.volume.quantize_visibility(&mut block);
        }
        self.visibility = Some(block);
    }

    pub fn update(&self) -> Update<'_> {
        Update {
            track: self.track.id,
            base: &self.base,
            probes: &self.probes,
            visibility: match self.send_visibility {
                true => self.visibility.as_deref(),
                false => None,
            },
        }
    }
}

pub fn raw_probe(random: &mut Random) -> Probe {
    let mut codes = [0; CODES];
    for (at, code) in codes.iter_mut().enumerate() {
        // Any finite f16, of degree 0 not a negative one.
        let bits = random.below(0x7c00) as u16 | (random.below(2) as u16) << 15;
        *code = if at < 3 { bits & 0x7fff } else { bits } as i16;
    }
    Probe { level: 3, codes }
}

/// The largest code of each of 27 places.
pub fn most(steps: &Steps) -> [i32; CODES] {
    let ([y0, y1, y2], [c0, c1, c2]) = (steps.luma, steps.chroma);
    let mut most = [0; CODES];
    let groups = [(1, y0), (2, c0), (3, y1), (6, c1), (5, y2), (10, c2)];
    let mut at = 0;
    for (count, step) in groups {
        let range = if at == 0 { 40 * 256 - 1 } else { 32768 };
        most[at..at + count].fill((range / i32::from(step)).min(32767));
        at += count;
    }
    most
}

pub fn packed_probe(random: &mut Random, steps: &Steps) -> Probe {
    let mut probe = Probe {
        level: 3,
        codes: [0; CODES],
    };
    let small = random.below(2) == 0;
    for ((at, code), most) in probe.codes.iter_mut().enumerate().zip(most(steps)) {
        let most = if small { most.min(9) } else { most };
        let drawn = random.below(2 * most as u32 + 1) as i32 - most;
        *code = if at == 0 { drawn.abs() } else { drawn } as i16;
    }
    probe.cut(1 + random.below(3) as u8)
}

fn nudged(mut probe: Probe, random: &mut Random, steps: &Steps) -> Probe {
    let used = [0, 3, 12, 27][usize::from(probe.level)];
    for (at, code) in probe.codes[..used].iter_mut().enumerate() {
        let most = most(steps)[at];
        let low = if at == 0 { 0 } else { -most };
        if random.below(4) == 0 {
            let step = random.below(3) as i32 - 1;
            *code = (i32::from(*code) + step).clamp(low, most) as i16;
        }
    }
    probe
}

/// What a decoder shows of a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownVolume {
    pub probes: Vec<Probe>,
    pub texels: Vec<Texel>,
    pub visibility: Option<Vec<u8>>,
}

pub fn shown_volume(decoder: &Decoder, track: &TrackState) -> ShownVolume {
    let state = decoder.probes();
    ShownVolume {
        probes: state.probes_of(track).to_vec(),
        texels: state.texels_of(track).to_vec(),
        visibility: state.visibility_of(track).map(<[u8]>::to_vec),
    }
}
