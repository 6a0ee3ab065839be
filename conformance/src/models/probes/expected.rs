//! Expected content of tracks of `probes`, worked out a second time from `spec/probes.md`.

use std::hash::Hasher as _;

use twox_hash::XxHash64;

use super::maps::{self, Choices};
use super::range::{self, Bit};
use super::values;
use super::writer::{self, Probe, Section, Volume};
use crate::models::ExpectedState;
use crate::stream_builder::words;

/// The probes of a track.
#[derive(Clone, Debug)]
pub struct Probes {
    pub volume: Volume,
    /// All probes of the volume.
    pub probes: Vec<Probe>,
    /// The visibility block, once one was sent.
    pub visibility: Option<Vec<u8>>,
}

impl Probes {
    /// Absent probes without visibility.
    pub fn new(volume: &Volume) -> Probes {
        Probes {
            volume: volume.clone(),
            probes: vec![Probe::ABSENT; volume.count()],
            visibility: None,
        }
    }

    /// Applies a keyframe or delta that leaves the probes as in `content`.
    pub fn write(&mut self, keyframe: bool, content: &Content) {
        if keyframe {
            self.visibility = None;
        }
        self.probes.clone_from(&content.probes);
        if content.visibility.is_some() {
            self.visibility.clone_from(&content.visibility);
        }
    }

    /// The section that makes the probes what `content` says.
    pub fn section(&self, keyframe: bool, content: &Content) -> Section {
        let base = (!keyframe).then_some(&self.probes[..]);
        let id = content.id;
        if !self.volume.is_packed() {
            return Section {
                id,
                visibility: content.visibility.clone(),
                probes: writer::raw(base, &content.probes, &content.touched),
                ..Section::default()
            };
        }
        let coded = range::code(&self.bits(keyframe, content));
        Section {
            id,
            flags: content.visibility.as_ref().map(|_| 1),
            probes: match content.whole {
                true => coded.whole(),
                false => coded.short(),
            },
            ..Section::default()
        }
    }

    /// The bits of that section in a packed volume.
    pub fn bits(&self, keyframe: bool, content: &Content) -> Vec<Bit> {
        let base = (!keyframe).then_some(&self.probes[..]);
        let mut bits = Vec::new();
        if let Some(block) = &content.visibility {
            let base = self.visibility.as_deref().filter(|_| !keyframe);
            bits = maps::bits(&self.volume, base, block, &content.maps);
            if content.maps.wrong.is_some() {
                return bits;
            }
        }
        bits.extend(writer::bits(
            &self.volume,
            base,
            &content.probes,
            &content.touched,
        ));
        bits
    }
}

impl ExpectedState for Probes {
    /// `spec/probes.md` §11.
    fn digest(&self, digest: &mut XxHash64) {
        for (index, probe) in (0..).zip(&self.probes) {
            if probe.level > 0 {
                digest.write(&words(&[index, probe.level.into()]));
                let codes = probe.codes.iter();
                codes.for_each(|&code| digest.write(&(code as u16).to_le_bytes()));
                digest.write(&[0; 2]);
            }
        }
        digest.write(&words(&[u32::from(self.visibility.is_some())]));
        digest.write(self.visibility.as_deref().unwrap_or_default());
    }

    fn digest_lines(&self, track: u32) -> Vec<String> {
        values::lines(track, self)
    }
}

/// What a track's probes are after a frame.
#[derive(Clone, Debug)]
pub struct Content {
    pub id: u32,
    /// All probes.
    pub probes: Vec<Probe>,
    /// Its visibility block, where it is sent.
    pub visibility: Option<Vec<u8>>,
    /// Probes that are written as changing though they may not.
    pub touched: Vec<usize>,
    /// How its maps are written.
    pub maps: Choices,
    /// With all zeros at the end of packed probes.
    pub whole: bool,
}

impl Content {
    /// Probes of a track.
    pub fn new(id: u32, probes: Vec<Probe>) -> Content {
        Content {
            id,
            probes,
            visibility: None,
            touched: Vec::new(),
            maps: Choices::default(),
            whole: false,
        }
    }
}
