//! A small server that does what the input says: hash grids and volumes that change, and the valid
//! streams that it writes of them.

use std::collections::BTreeMap;

use arbitrary::{Result, Unstructured};
use dapple_codec::{
    Compression, Encoder, EncoderConfig, GroupStart, Model, ModelKind, StateDigest, Target,
    TickRate, Track, Transform,
};

use crate::models::{self, Content, TrackContent};
use crate::viewer::ShownTrack;

/// A valid stream.
pub struct Script {
    /// Its bytes, `end` included.
    pub bytes: Vec<u8>,
    /// The state at each frame number.
    pub frames: BTreeMap<u32, Vec<ShownTrack>>,
}

/// A stream of a few frames.
pub fn script(u: &mut Unstructured<'_>) -> Result<Script> {
    let mut server = Server::new(u)?;
    for _ in 0..u.int_in_range(1..=8)? {
        server.frame(u)?;
    }
    server.encoder.end(&mut server.bytes).expect("end");
    Ok(Script {
        bytes: server.bytes,
        frames: server.frames,
    })
}

/// A track of any model.
pub fn track(u: &mut Unstructured<'_>, id: u32) -> Result<Track> {
    let model = models::any(u)?;
    track_of(u, id, model)
}

/// A track of a model with parameters that hold.
pub fn track_of_kind(u: &mut Unstructured<'_>, id: u32, kind: ModelKind) -> Result<Track> {
    let model = models::of_kind(u, kind)?;
    track_of(u, id, model)
}

fn track_of(u: &mut Unstructured<'_>, id: u32, model: Model) -> Result<Track> {
    let low = f32::from(u.arbitrary::<i8>()?);
    let spaces = model.kind().spaces();
    Ok(Track {
        id,
        target: Target {
            application_id: u.arbitrary::<u8>()?.into(),
            path: ["", "a", "hall/floor", "möbel/büro \"3\""][u.choose_index(4)?].into(),
            content_hash: u.arbitrary::<bool>()?.then_some(id.into()),
        },
        aabb_min: [low; 3],
        aabb_max: [low, low + 1.0, low + 2.0],
        space: *u.choose(spaces)?,
        model,
    })
}

/// A matrix that is the identity but for one number.
pub fn matrix(u: &mut Unstructured<'_>) -> Result<[[f32; 4]; 3]> {
    let mut matrix = Transform::IDENTITY.world_from_grid;
    matrix[u.choose_index(3)?][u.choose_index(4)?] = f32::from(u.arbitrary::<i8>()?) / 4.0;
    Ok(matrix)
}

/// Some way to pack a payload.
pub fn compression(u: &mut Unstructured<'_>) -> Result<Compression> {
    Ok(match u.int_in_range(0..=5)? {
        0 | 1 => Compression::None,
        2 | 3 => Compression::Lz4,
        4 => Compression::PAPER,
        _ => Compression::Zstd {
            level: u.int_in_range(1..=19)?,
            lazy: u.arbitrary()?,
        },
    })
}

struct Table {
    track: Track,
    transform: Option<Transform>,
    content: Content,
    /// Ends at the next commit.
    removed: bool,
}

struct Server {
    encoder: Encoder,
    bytes: Vec<u8>,
    tables: Vec<Table>,
    next_id: u32,
    tick: u64,
    frames: BTreeMap<u32, Vec<ShownTrack>>,
}

impl Server {
    fn new(u: &mut Unstructured<'_>) -> Result<Server> {
        let tick_rate = TickRate {
            numerator: u.int_in_range(1..=120)?,
            denominator: 1,
        };
        let mut bytes = Vec::new();
        let config = EncoderConfig {
            tick_rate,
            ..EncoderConfig::default()
        };
        let encoder = Encoder::new(config, &mut bytes).expect("preamble");
        Ok(Server {
            encoder,
            bytes,
            tables: Vec::new(),
            next_id: u.int_in_range(0..=3)?,
            tick: 0,
            frames: BTreeMap::new(),
        })
    }

    /// Everything up to and with a commit.
    fn frame(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        self.declare(u)?;
        self.remove(u)?;
        let first = self.frames.is_empty();
        let keyframes = match u.int_in_range(0..=4)? {
            _ if first => true,
            0 | 1 => true,
            2 => {
                let start = GroupStart::State(self.digest(true));
                self.encoder.group(&mut self.bytes, start).expect("group");
                false
            }
            _ => false,
        };
        if keyframes {
            self.encoder
                .group(&mut self.bytes, GroupStart::Keyframes)
                .expect("group");
            if u.arbitrary()? {
                let kept = self.tables.iter().filter(|t| !t.removed);
                let kept: Vec<Track> = kept.map(|t| t.track.clone()).collect();
                self.encoder
                    .tracks(&mut self.bytes, &kept)
                    .expect("declared again");
            }
            for table in &mut self.tables {
                table.transform = None;
            }
        }
        self.declare(u)?;
        self.remove(u)?;
        if u.arbitrary()? {
            self.transforms(u)?;
        }
        self.content(u, keyframes)?;
        self.tables.retain(|t| !t.removed);
        self.tick += u64::from(u.int_in_range(0u8..=3)?);
        let digest = u.arbitrary::<bool>()?.then(|| self.digest(false));
        let number = self
            .encoder
            .commit(&mut self.bytes, self.tick, digest)
            .expect("commit");
        let shown = self.tables.iter().map(Table::shown).collect();
        self.frames.insert(number, shown);
        Ok(())
    }

    fn declare(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let wanted = if self.tables.is_empty() { 1..=3 } else { 0..=1 };
        let count = u.int_in_range(wanted)?.min(8 - self.tables.len().min(8));
        let mut tracks = Vec::new();
        for _ in 0..count {
            tracks.push(track(u, self.next_id)?);
            self.next_id += u.int_in_range(1..=3)?;
        }
        if tracks.is_empty() {
            return Ok(());
        }
        self.encoder
            .tracks(&mut self.bytes, &tracks)
            .expect("tracks");
        self.tables.extend(tracks.into_iter().map(Table::new));
        Ok(())
    }

    fn remove(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        if !u.ratio(1, 6)? {
            return Ok(());
        }
        let mut ids = Vec::new();
        for table in self.tables.iter_mut().filter(|t| !t.removed) {
            if u.arbitrary()? {
                table.removed = true;
                ids.push(table.track.id);
            }
        }
        self.encoder
            .remove_tracks(&mut self.bytes, &ids)
            .expect("remove");
        Ok(())
    }

    fn transforms(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let mut entries = Vec::new();
        for table in self.tables.iter_mut().filter(|t| !t.removed) {
            if u.arbitrary()? {
                let transform = Transform {
                    world_from_grid: matrix(u)?,
                };
                table.transform = Some(transform);
                entries.push((table.track.id, transform));
            }
        }
        let compression = compression(u)?;
        self.encoder
            .transforms(&mut self.bytes, &entries, compression)
            .expect("transforms");
        Ok(())
    }

    /// Content of some tracks, some of it as keyframes.
    fn content(&mut self, u: &mut Unstructured<'_>, group: bool) -> Result<()> {
        for kind in ModelKind::ALL {
            let mut named = Vec::new();
            let tables = self.tables.iter_mut();
            for table in tables.filter(|table| table.track.model.kind() == kind) {
                let has_content = !table.removed && u.ratio(3, 4)?;
                if !has_content {
                    if group {
                        table.content = Content::empty(&table.track.model);
                    }
                    continue;
                }
                named.push(TrackContent {
                    id: table.track.id,
                    model: table.track.model,
                    content: &mut table.content,
                    keyframe: group || u.ratio(1, 4)?,
                });
            }
            models::write(u, kind, named, &mut self.encoder, &mut self.bytes)?;
        }
        Ok(())
    }

    /// Of the tables as they are, with those that wait for their removal or without.
    fn digest(&self, with_removed: bool) -> u64 {
        let mut digest = StateDigest::new();
        for table in self.tables.iter().filter(|t| with_removed || !t.removed) {
            let transform = table.transform.as_ref();
            table.content.digest(table.track.id, transform, &mut digest);
        }
        digest.finish()
    }
}

impl Table {
    fn new(track: Track) -> Table {
        Table {
            transform: None,
            content: Content::empty(&track.model),
            removed: false,
            track,
        }
    }

    fn shown(&self) -> ShownTrack {
        ShownTrack {
            track: self.track.clone(),
            transform: self.transform,
            content: self.content.clone(),
        }
    }
}
