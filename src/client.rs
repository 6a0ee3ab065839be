//! The client: takes the bytes of a stream in, and finds what each track belongs to in a scene that
//! the client has, too. What a model needs to draw with is a view that borrows it:
//! [`PointsView`](crate::points::client::PointsView),
//! [`ProbesView`](crate::probes::client::ProbesView),
//! [`InstancesView`](crate::instances::client::InstancesView).

use crate::codec::{Decoder, Event, Limits, Track};
use crate::{Error, Result};
use std::collections::BTreeMap;

/// A mesh instance of the client's scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instance {
    /// Path of its node, as in [`codec::Target::path`](crate::codec::Target::path).
    pub path: String,
    /// Hash of its mesh, as in [`codec::Target::content_hash`](crate::codec::Target::content_hash).
    pub content_hash: u64,
}

/// Follows a stream that was made for a scene the client has, too.
pub struct Client {
    decoder: Decoder,
    instances: Vec<Instance>,
    instance_of_path: BTreeMap<String, usize>,
    /// By track id, which is never used again in a stream.
    instance_of_track: BTreeMap<u32, usize>,
    ended: bool,
}

impl Client {
    /// A client that has these instances.
    pub fn new(instances: Vec<Instance>, limits: Limits) -> Client {
        let paths = instances.iter().enumerate();
        Client {
            decoder: Decoder::new(limits),
            instance_of_path: paths.map(|(i, x)| (x.path.clone(), i)).collect(),
            instances,
            instance_of_track: BTreeMap::new(),
            ended: false,
        }
    }

    /// A client that has a scene.
    #[cfg(feature = "encode")]
    pub fn of_scene(scene: &crate::scene::Scene, limits: Limits) -> Client {
        let instances = scene.instances.iter().map(|instance| Instance {
            path: instance.name.clone(),
            content_hash: scene.mesh_hash(instance.mesh),
        });
        Client::new(instances.collect(), limits)
    }

    /// Takes the next bytes of the stream in; returns the frames that they completed.
    ///
    /// # Errors
    /// What the decoder says of the bytes; `Invalid` for a stream of another scene. The last
    /// completed frame stays as it was, and can be drawn.
    pub fn push(&mut self, bytes: &[u8]) -> Result<usize> {
        let (mut used, mut frames) = (0, 0);
        while used < bytes.len() && !self.ended {
            let (consumed, shown) = self.push_until(&bytes[used..], 0)?;
            used += consumed;
            frames += usize::from(shown);
            if !shown {
                break;
            }
        }
        Ok(frames)
    }

    /// Takes bytes in up to and including frame `number`; returns how many bytes it used and
    /// whether the frame is there.
    ///
    /// # Errors
    /// As [`Client::push`].
    pub fn push_until(&mut self, bytes: &[u8], number: u32) -> Result<(usize, bool)> {
        let mut used = 0;
        let mut shown = false;
        let mut stopped = None;
        while used < bytes.len() && !self.ended {
            match self.decoder.push(&bytes[used..]) {
                Err(error) => {
                    stopped = Some(error);
                    break;
                }
                Ok((consumed, event)) => {
                    used += consumed;
                    match event {
                        Event::NeedInput => break,
                        Event::End => self.ended = true,
                        Event::Frame(frame) => {
                            shown = true;
                            if frame.number >= number {
                                self.bind()?;
                                return Ok((used, true));
                            }
                        }
                        _ => {}
                    }
                }
            }
        }
        // Frames before the end of the bytes count, and those before an error, too.
        if shown {
            self.bind()?;
        }
        match stopped {
            Some(error) => Err(error.into()),
            None => Ok((used, false)),
        }
    }

    /// Whether the stream's end was reached.
    pub fn ended(&self) -> bool {
        self.ended
    }

    pub fn decoder(&self) -> &Decoder {
        &self.decoder
    }

    /// Number and time in seconds of the last frame; the time is on the animation's clock.
    pub fn last_frame(&self) -> Option<(u32, f64)> {
        let (number, tick) = self.decoder.last_frame()?;
        let rate = self.decoder.tick_rate()?;
        Some((number, tick as f64 / rate.hz()))
    }

    /// Mesh instances that the client has.
    pub fn instance_count(&self) -> usize {
        self.instances.len()
    }

    /// The mesh instances that the client has.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// The instance that a track belongs to; `None` for a track of the whole scene or of all
    /// instances of a mesh.
    pub fn instance_of(&self, track: &Track) -> Option<usize> {
        self.instance_of_track.get(&track.id).copied()
    }

    /// Finds the instance of every track.
    fn bind(&mut self) -> Result<()> {
        self.instance_of_track.clear();
        for live in self.decoder.tracks() {
            let target = &live.track.target;
            let Some(&instance) = self.instance_of_path.get(&target.path) else {
                // Of the whole scene, or of all instances of a mesh.
                let of_mesh = |hash| self.instances.iter().any(|i| i.content_hash == hash);
                if target.path.is_empty() && target.content_hash.is_none_or(of_mesh) {
                    continue;
                }
                return Err(Error::Invalid(format!(
                    "the stream has light for '{}', which the scene does not have: it was made for \
                     another scene",
                    target.path
                )));
            };
            let hash = target.content_hash;
            if hash.is_some_and(|hash| hash != self.instances[instance].content_hash) {
                return Err(Error::Invalid(format!(
                    "the stream has light for another mesh of '{}' than the scene has: it was made \
                     for another version of the scene",
                    target.path
                )));
            }
            self.instance_of_track.insert(live.track.id, instance);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::probes::{Coding, Coverage, Probe, Update, Visibility, Volume};
    use crate::codec::{
        Compression, Encoder, EncoderConfig, GroupStart, LookupSpace, Model, Target,
    };
    use crate::probes::client::ProbesView;

    /// A stream of two frames with one probe, and where the second frame begins.
    fn stream(path: &str) -> (Vec<u8>, usize) {
        let volume = Volume {
            grid_from_mesh: [
                [1.0, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 0.0],
            ],
            dims: [1, 1, 1],
            spacing: [1.0; 3],
            exponent: 0,
            visibility: Visibility::default(),
            coding: Coding::Raw,
        };
        let track = Track {
            id: 7,
            target: Target {
                path: path.into(),
                ..Target::default()
            },
            aabb_min: [0.0; 3],
            aabb_max: [1.0; 3],
            space: LookupSpace::Mesh,
            model: Model::Probes(volume),
        };
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).unwrap();
        encoder.group(&mut bytes, GroupStart::Keyframes).unwrap();
        encoder.tracks(&mut bytes, &[track]).unwrap();
        let update = Update {
            track: 7,
            base: &[],
            probes: &[Probe::ABSENT],
            visibility: None,
        };
        let none = Compression::None;
        encoder
            .probes(&mut bytes, Coverage::Keyframe, &[update], none)
            .unwrap();
        encoder.commit(&mut bytes, 0, None).unwrap();
        let second = bytes.len();
        encoder.commit(&mut bytes, 1, None).unwrap();
        encoder.end(&mut bytes).unwrap();
        (bytes, second)
    }

    fn client() -> Client {
        let lamp = Instance {
            path: "lamp".into(),
            content_hash: 1,
        };
        Client::new(vec![lamp], Limits::default())
    }

    #[test]
    fn frame_before_an_error_is_bound() {
        let (mut bytes, second) = stream("lamp");
        bytes[second] ^= 1;
        for until in [false, true] {
            let mut client = client();
            match until {
                false => assert!(client.push(&bytes).is_err()),
                // A frame before the one that is asked for, too.
                true => assert!(client.push_until(&bytes, 1).is_err()),
            }
            assert_eq!(client.last_frame().map(|(number, _)| number), Some(0));
            let track = client.decoder().tracks()[0].track.clone();
            assert_eq!(client.instance_of(&track), Some(0));
            assert_eq!(ProbesView::new(&client).volumes.len(), 1);
        }
    }

    #[test]
    fn frames_are_bound_however_the_bytes_are_cut() {
        let (bytes, _) = stream("lamp");
        for piece in [1, 7, bytes.len()] {
            let mut client = client();
            let frames: usize = bytes
                .chunks(piece)
                .map(|piece| client.push(piece).unwrap())
                .sum();
            assert!(frames == 2 && client.ended());
            let track = client.decoder().tracks()[0].track.clone();
            assert_eq!(client.instance_of(&track), Some(0));
        }
    }

    #[test]
    fn track_without_target_is_of_the_whole_scene() {
        let (bytes, _) = stream("");
        let mut client = client();
        assert_eq!(client.push(&bytes).unwrap(), 2);
        let track = client.decoder().tracks()[0].track.clone();
        assert_eq!(client.instance_of(&track), None);
    }

    #[test]
    fn stream_of_another_scene_is_refused() {
        let (bytes, _) = stream("sofa");
        let error = client().push(&bytes).unwrap_err().to_string();
        assert!(error.contains("'sofa'"), "{error}");
    }
}
