//! Volumes of `probes` and their records, byte by byte, from `spec/probes.md` alone.

use super::range::Bit;
use crate::models::Parameters;
use crate::models::entry::Entry;
use crate::stream_builder::{IDENTITY, floats, words};

/// The parameters of a volume as they will stand there.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    pub grid_from_mesh: [f32; 12],
    pub dims: [u16; 3],
    pub dims_reserved: u16,
    pub spacing: [f32; 3],
    pub exponent: i8,
    pub side: u8,
    /// Steps of means and deviations; 0 for raw probes, and without visibility.
    pub map_steps: [u8; 2],
    pub range: f32,
    /// All 0 for raw probes.
    pub steps: [u16; 6],
}

impl Volume {
    /// Raw probes, half a metre apart, without visibility.
    pub fn raw(dims: [u16; 3]) -> Volume {
        Volume {
            grid_from_mesh: IDENTITY,
            dims,
            dims_reserved: 0,
            spacing: [0.5, 0.75, 1.0],
            exponent: 0,
            side: 0,
            map_steps: [0; 2],
            range: 0.0,
            steps: [0; 6],
        }
    }

    /// The same with packed probes of middling steps.
    pub fn packed(dims: [u16; 3]) -> Volume {
        Volume {
            steps: [16, 200, 300, 500, 600, 900],
            ..Volume::raw(dims)
        }
    }

    /// With visibility of a side, up to 8 m.
    pub fn seeing(self, side: u8) -> Volume {
        let map_steps = match self.is_packed() {
            true => [7, 30],
            false => [0; 2],
        };
        Volume {
            side,
            range: 8.0,
            map_steps,
            ..self
        }
    }

    /// The 88 bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = floats(&self.grid_from_mesh);
        bytes.extend(self.dims.iter().flat_map(|dim| dim.to_le_bytes()));
        bytes.extend(self.dims_reserved.to_le_bytes());
        bytes.extend(floats(&self.spacing));
        bytes.extend(self.exponent.to_le_bytes());
        bytes.push(self.side);
        bytes.extend(self.map_steps);
        bytes.extend(floats(&[self.range]));
        bytes.extend(self.steps.iter().flat_map(|step| step.to_le_bytes()));
        bytes
    }

    /// Number of probes.
    pub fn count(&self) -> usize {
        self.dims.map(usize::from).iter().product()
    }

    /// Whether probes are packed.
    pub fn is_packed(&self) -> bool {
        self.steps != [0; 6]
    }

    /// Bytes of a visibility block.
    pub fn visibility_bytes(&self) -> usize {
        2 * usize::from(self.side) * usize::from(self.side) * self.count()
    }

    /// Those probes next to one, before it along x, y and z (`back`), or after it.
    pub fn next_to(&self, probe: usize, back: bool) -> Vec<usize> {
        let [dx, dy, dz] = self.dims.map(usize::from);
        let place = [probe % dx, probe / dx % dy, probe / dx / dy];
        let strides = [1, dx, dx * dy];
        (0..3)
            .filter(|&axis| match back {
                true => place[axis] > 0,
                false => place[axis] + 1 < [dx, dy, dz][axis],
            })
            .map(|axis| match back {
                true => probe - strides[axis],
                false => probe + strides[axis],
            })
            .collect()
    }
}

impl Entry {
    /// An entry of `probes`, packed or raw as the volume has steps or none.
    pub fn of_volume(id: u32, volume: Volume) -> Entry {
        let coding = u16::from(volume.is_packed());
        Entry::of(id, 2, coding, Parameters::Probes(volume))
    }

    /// The parameters of an entry of `probes`; `None` for another model.
    pub fn volume(&self) -> Option<&Volume> {
        let Parameters::Probes(volume) = &self.parameters else {
            return None;
        };
        Some(volume)
    }
}

/// A probe: its level, and codes that may be beyond what a decoder takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Probe {
    pub level: u8,
    pub codes: [i32; 27],
}

impl Probe {
    pub const ABSENT: Probe = Probe {
        level: 0,
        codes: [0; 27],
    };

    /// Of a level, from the first of its codes.
    pub fn new(level: u8, codes: &[i32]) -> Probe {
        let mut probe = Probe {
            level,
            ..Probe::ABSENT
        };
        probe.codes[..codes.len()].copy_from_slice(codes);
        probe
    }

    /// A raw probe, from the first bits of its values.
    pub fn raw(values: &[u16]) -> Probe {
        let codes: Vec<i32> = values.iter().map(|&bits| i32::from(bits as i16)).collect();
        Probe::new(3, &codes)
    }
}

/// The groups of codes: the first code of each, and one past the last.
pub const GROUPS: [usize; 7] = [0, 1, 3, 6, 12, 17, 27];

/// Numbers of the contexts (§6.4).
pub mod context {
    pub fn changed(absent: bool, around: usize) -> usize {
        4 * usize::from(absent) + around
    }
    pub const OTHER: usize = 8;
    pub fn level(base: u8, second: bool) -> usize {
        9 + 2 * usize::from(base) + usize::from(second)
    }
    pub fn any(intra: bool, group: usize, around: usize, before: bool) -> usize {
        17 + 48 * usize::from(intra) + 8 * group + 2 * around + usize::from(before)
    }
    pub fn some(intra: bool, group: usize, around: usize) -> usize {
        113 + 24 * usize::from(intra) + 4 * group + around
    }
    pub fn against(intra: bool, group: usize, sure: usize) -> usize {
        161 + 6 * usize::from(intra) + 3 * (group % 2) + sure
    }
    pub fn longer(intra: bool, group: usize, length: usize) -> usize {
        173 + 36 * usize::from(intra) + 6 * group + length.min(5)
    }
    pub fn second(intra: bool, group: usize) -> usize {
        245 + 6 * usize::from(intra) + group
    }
}

/// The bits of probes that change from `base`, an absent one each where it is `None`. Those in
/// `touched` are written as changing even where they do not.
pub fn bits(
    volume: &Volume,
    base: Option<&[Probe]>,
    probes: &[Probe],
    touched: &[usize],
) -> Vec<Bit> {
    let mut writer = BitWriter {
        volume,
        bits: Vec::new(),
        changed: vec![false; probes.len()],
        residuals: vec![[0; 27]; probes.len()],
    };
    for index in 0..probes.len() {
        let base = base.map_or(Probe::ABSENT, |base| base[index]);
        writer.probe(index, base, probes, touched.contains(&index));
    }
    writer.bits
}

/// The program of §6.3, as it is written.
struct BitWriter<'a> {
    volume: &'a Volume,
    bits: Vec<Bit>,
    changed: Vec<bool>,
    residuals: Vec<[i32; 27]>,
}

impl BitWriter<'_> {
    fn bit(&mut self, context: usize, one: bool) -> bool {
        self.bits.push(Bit::In(context, one));
        one
    }

    fn probe(&mut self, index: usize, base: Probe, probes: &[Probe], touched: bool) {
        let near = self.volume.next_to(index, true);
        let target = probes[index];
        let c = near.iter().filter(|&&n| self.changed[n]).count();
        let changes = touched || target != base;
        if !self.bit(context::changed(base.level == 0, c), changes) {
            return;
        }
        self.changed[index] = true;
        self.level(base.level, target.level);
        let mut before = false;
        for group in 0..2 * usize::from(target.level) {
            let intra = base.level as usize <= group / 2;
            let codes = GROUPS[group]..GROUPS[group + 1];
            for code in codes.clone() {
                let predicted = match intra {
                    true => mean(&near, probes, group / 2, code),
                    false => base.codes[code],
                };
                self.residuals[index][code] = target.codes[code] - predicted;
            }
            let own = self.residuals[index];
            let c = self.around(&near, codes.clone());
            let any = own[codes.clone()].iter().any(|&r| r != 0);
            before = self.bit(context::any(intra, group, c, before), any);
            for code in codes.clone().filter(|_| any) {
                let c = self.around(&near, code..code + 1);
                let sure = code + 1 == codes.end && own[codes.start..code].iter().all(|&r| r == 0);
                if sure || self.bit(context::some(intra, group, c), own[code] != 0) {
                    let signs = near.iter().map(|&n| self.residuals[n][code].signum());
                    self.residual(intra, group, signs.sum(), own[code]);
                }
            }
        }
    }

    fn level(&mut self, base: u8, target: u8) {
        if base > 0 && !self.bit(context::OTHER, target != base) {
            return;
        }
        let others: Vec<u8> = [3, 2, 1, 0].into_iter().filter(|&l| l != base).collect();
        if self.bit(context::level(base, false), target != others[0]) {
            self.bit(context::level(base, true), target != others[1]);
        }
    }

    /// How many neighbours have a residual of some of these codes.
    fn around(&self, near: &[usize], codes: std::ops::Range<usize>) -> usize {
        let some = |n: &&usize| self.residuals[**n][codes.clone()].iter().any(|&r| r != 0);
        near.iter().filter(some).count()
    }

    fn residual(&mut self, intra: bool, group: usize, s: i32, residual: i32) {
        let against = (residual < 0) != (s < 0);
        let sure = (s.unsigned_abs() as usize).min(2);
        self.bit(context::against(intra, group, sure), against);
        let magnitude = residual.unsigned_abs();
        let length = magnitude.ilog2() as usize;
        for e in 0..length.min(15) {
            self.bit(context::longer(intra, group, e), true);
        }
        if length < 15 {
            self.bit(context::longer(intra, group, length), false);
        }
        for k in 0..length {
            let one = magnitude >> (length - 1 - k) & 1 == 1;
            match k {
                0 => _ = self.bit(context::second(intra, group), one),
                _ => self.bits.push(Bit::Even(one)),
            }
        }
    }
}

/// The prediction of a code of an intra group (B-041).
pub fn mean(near: &[usize], probes: &[Probe], degree: usize, code: usize) -> i32 {
    let with = near.iter().map(|&n| &probes[n]);
    let with = with.filter(|probe| usize::from(probe.level) > degree);
    let codes: Vec<i32> = with.map(|probe| probe.codes[code]).collect();
    match codes.len() {
        0 => 0,
        count => codes.iter().sum::<i32>().div_euclid(count as i32),
    }
}

/// The bytes of raw probes that change from `base`, or are `touched`.
pub fn raw(base: Option<&[Probe]>, probes: &[Probe], touched: &[usize]) -> Vec<u8> {
    let changes = |&(index, probe): &(usize, &Probe)| {
        touched.contains(&index) || *probe != base.map_or(Probe::ABSENT, |base| base[index])
    };
    let mut maps = [vec![0u8; probes.len().div_ceil(8)], Vec::new()];
    maps[1] = maps[0].clone();
    let mut values = Vec::new();
    for (index, probe) in probes.iter().enumerate().filter(changes) {
        maps[0][index / 8] |= 1 << (index % 8);
        if probe.level > 0 {
            maps[1][index / 8] |= 1 << (index % 8);
            values.extend(probe.codes.iter().flat_map(|&c| (c as i16).to_le_bytes()));
            values.extend([0; 2]);
        }
    }
    [maps.concat(), values].concat()
}

/// A track's part of a `probes` payload.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Section {
    pub id: u32,
    /// What the table says of its size; `None` for the one that fits.
    pub size: Option<u32>,
    /// What the table says of its flags; `None` for those that fit.
    pub flags: Option<u32>,
    /// The block of a raw volume.
    pub visibility: Option<Vec<u8>>,
    /// The rest: maps of a packed volume, and probes.
    pub probes: Vec<u8>,
}

/// Payload of a `probes` record; `base` is `None` for a keyframe.
pub fn payload(base: Option<u32>, sections: &[Section]) -> Vec<u8> {
    let flags = u32::from(base.is_none());
    let mut payload = words(&[sections.len() as u32, flags, base.unwrap_or(0), 0]);
    for section in sections {
        let seen = section.visibility.as_ref().map_or(0, Vec::len);
        let size = (seen + section.probes.len()) as u32;
        let flags = u32::from(section.visibility.is_some());
        payload.extend(words(&[
            section.id,
            section.size.unwrap_or(size),
            section.flags.unwrap_or(flags),
        ]));
    }
    for section in sections {
        payload.extend(section.visibility.iter().flatten());
        payload.extend(&section.probes);
    }
    payload
}
