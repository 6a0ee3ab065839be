//! Tracks of `regions` and content for them.
#![allow(dead_code)]

use crate::common::Random;
use dapple_codec::regions::*;
use dapple_codec::signals::{Kernel, Signals};
use dapple_codec::*;

/// Parameters for `count` regions of any form, of two signals.
pub fn set(count: u32, coding: Coding) -> RegionSet {
    RegionSet {
        signals: Signals::two(Kernel::exponential(2.0), Kernel::exponential(300.0), 0.97),
        count,
        capacity: 63 * count,
        exponent: 1,
        step: 32,
        coding,
    }
}

pub fn region_track(id: u32, set: RegionSet) -> Track {
    Track {
        id,
        target: Target::default(),
        aabb_min: [-10.0; 3],
        aabb_max: [10.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Regions(set),
    }
}

/// Content of a track, regions of all forms that it has.
pub fn content(set: &RegionSet, random: &mut Random) -> Content {
    let mut content = Content::default();
    for _ in 0..set.count {
        let form = Form {
            derivatives: Derivatives::ALL[random.below(3) as usize],
            degree: random.below(3) as u8,
            signals: 1 + random.below(u32::from(set.signals.count)) as u8,
            centred: random.below(2) == 0,
        };
        let corner = [0; 3].map(|_| random.below(100) as f32 / 7.0);
        let size = [0; 3].map(|_| random.below(30) as f32 / 5.0);
        let at = |share: f32| std::array::from_fn(|k| corner[k] + share * size[k]);
        let centre = (!form.centred).then(|| at(0.25));
        let mut coefficients = vec![0.0; form.coefficients()];
        for coefficient in &mut coefficients {
            let small = random.below(4) > 0;
            let unit = random.below(2001) as f32 / 1000.0 - 1.0;
            *coefficient = unit * if small { 0.02 } else { 1.9 };
        }
        set.push(&mut content, [corner, at(1.0)], centre, form, &coefficients)
            .unwrap();
    }
    content
}

pub fn update(track: u32, content: &Content) -> Update<'_> {
    Update {
        track,
        regions: &content.regions,
        pairs: &content.pairs,
    }
}

/// What a decoder shows of a track.
pub fn shown_content(decoder: &Decoder, track: &TrackState) -> Content {
    Content {
        regions: decoder.regions().regions_of(track).to_vec(),
        pairs: decoder.regions().pairs_of(track).to_vec(),
    }
}
