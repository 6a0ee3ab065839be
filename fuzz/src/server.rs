//! A small server that does what the input says: hash grids and volumes that change, and the valid
//! streams that it writes of them.

use std::collections::{BTreeMap, BTreeSet};

use arbitrary::{Result, Unstructured};
use dapple_codec::points::{
    BUCKET_ENTRIES, Bucket, CELL_POINTS, Cell, Coverage, EMPTY, Grid, PointWidths, Update,
};
use dapple_codec::probes::{self, Probe, Volume};
use dapple_codec::{
    Compression, Encoder, EncoderConfig, GroupStart, LookupSpace, Model, StateDigest, Target,
    TickRate, Track, Transform,
};

use crate::viewer::ShownTrack;
use crate::volumes;

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

/// A track of either model.
pub fn any_track(u: &mut Unstructured<'_>, id: u32) -> Result<Track> {
    if u.ratio(1, 2)? {
        return volume_track(u, id);
    }
    track(u, id)
}

/// A volume with parameters that hold.
pub fn volume_track(u: &mut Unstructured<'_>, id: u32) -> Result<Track> {
    let mut volume = volumes::volume(u)?;
    volume.grid_from_mesh = matrix(u)?;
    Ok(Track {
        space: LookupSpace::Mesh,
        model: Model::Probes(volume),
        ..track(u, id)?
    })
}

/// A track of points with parameters that hold.
pub fn track(u: &mut Unstructured<'_>, id: u32) -> Result<Track> {
    let dims = match u.int_in_range(0..=9)? {
        0 => [65_535, 65_535, 1],
        1 => [1, 3, 65_535],
        2 => [1, 1, 1],
        _ => [
            u.int_in_range(1..=9)?,
            u.int_in_range(1..=9)?,
            u.int_in_range(1..=9)?,
        ],
    };
    let radius = f32::from(u.int_in_range(1u8..=9)?) / 8.0;
    let low = f32::from(u.arbitrary::<i8>()?);
    Ok(Track {
        id,
        target: Target {
            application_id: u.arbitrary::<u8>()?.into(),
            path: ["", "a", "hall/floor", "möbel/büro \"3\""][u.choose_index(4)?].into(),
            content_hash: u.arbitrary::<bool>()?.then_some(id.into()),
        },
        aabb_min: [low; 3],
        aabb_max: [low, low + 1.0, low + 2.0],
        space: if u.arbitrary()? {
            LookupSpace::Mesh
        } else {
            LookupSpace::Rest
        },
        model: Model::Points(Grid {
            grid_from_mesh: matrix(u)?,
            dims,
            cell_edge: radius * if u.arbitrary()? { 2.0 } else { 3.0 },
            radius,
            widths: widths(u)?,
            bucket_count: u.int_in_range(1..=17)?,
            cell_capacity: u.int_in_range(1..=24)?,
        }),
    })
}

fn widths(u: &mut Unstructured<'_>) -> Result<PointWidths> {
    let (position, normal, ao) = *u.choose(&[
        (5, 4, 8),
        (4, 3, 5),
        (2, 2, 5),
        (8, 2, 3),
        (1, 2, 8),
        (3, 4, 6),
        (1, 8, 4),
    ])?;
    Ok(PointWidths {
        position,
        normal,
        ao,
    })
}

fn matrix(u: &mut Unstructured<'_>) -> Result<[[f32; 4]; 3]> {
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
    buckets: Vec<Bucket>,
    cells: Vec<Cell>,
    changed_buckets: BTreeSet<u32>,
    changed_cells: BTreeSet<u32>,
    probes: Vec<Probe>,
    /// The probes of the last commit.
    committed: Vec<Probe>,
    visibility: Option<Vec<u8>>,
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
                let live = self.tables.iter().filter(|t| !t.removed);
                let live: Vec<Track> = live.map(|t| t.track.clone()).collect();
                self.encoder
                    .tracks(&mut self.bytes, &live)
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
        for table in &mut self.tables {
            table.committed.clone_from(&table.probes);
        }
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
            tracks.push(any_track(u, self.next_id)?);
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
        let (mut full, mut partial) = (Vec::new(), Vec::new());
        let (mut full_volumes, mut partial_volumes) = (Vec::new(), Vec::new());
        for table in &mut self.tables {
            let named = !table.removed && u.ratio(3, 4)?;
            if group && !named {
                table.empty();
            }
            if !named {
                continue;
            }
            let keyframe = group || u.ratio(1, 4)?;
            if let Some(volume) = table.track.volume().copied() {
                let into = if keyframe {
                    &mut full_volumes
                } else {
                    &mut partial_volumes
                };
                into.push(table.volume(u, &volume, keyframe)?);
                continue;
            }
            for _ in 0..u.int_in_range(0..=6)? {
                table.change(u)?;
            }
            let into = if keyframe { &mut full } else { &mut partial };
            into.push(table.content(keyframe));
        }
        for (coverage, contents) in [(Coverage::Keyframe, full), (Coverage::Delta, partial)] {
            // One record or two.
            let split = u.int_in_range(0..=contents.len())?;
            for part in [&contents[..split], &contents[split..]]
                .into_iter()
                .filter(|p| !p.is_empty())
            {
                let updates: Vec<Update<'_>> = part.iter().map(Content::update).collect();
                let compression = compression(u)?;
                let written = self
                    .encoder
                    .points(&mut self.bytes, coverage, &updates, compression);
                written.expect("points");
            }
        }
        for (coverage, contents) in [
            (Coverage::Keyframe, full_volumes),
            (Coverage::Delta, partial_volumes),
        ] {
            let split = u.int_in_range(0..=contents.len())?;
            for part in [&contents[..split], &contents[split..]]
                .into_iter()
                .filter(|p| !p.is_empty())
            {
                let updates: Vec<_> = part.iter().map(VolumeContent::update).collect();
                let compression = compression(u)?;
                let written = self
                    .encoder
                    .probes(&mut self.bytes, coverage, &updates, compression);
                written.expect("probes");
            }
        }
        Ok(())
    }

    /// Of the tables as they are, with those that wait for their removal or without.
    fn digest(&self, with_removed: bool) -> u64 {
        let mut digest = StateDigest::new();
        for table in self.tables.iter().filter(|t| with_removed || !t.removed) {
            let transform = table.transform.as_ref();
            let id = table.track.id;
            match table.track.volume() {
                Some(_) => digest.volume(id, transform, &table.probes, table.visibility.as_deref()),
                None => digest.track(id, transform, &table.buckets, &table.cells),
            }
        }
        digest.finish()
    }
}

impl Table {
    fn new(track: Track) -> Table {
        let (buckets, cells) = match track.grid() {
            Some(grid) => (grid.bucket_count as usize, grid.cell_capacity as usize),
            None => (0, 0),
        };
        let probes = vec![Probe::ABSENT; track.volume().map_or(0, Volume::count)];
        Table {
            track,
            transform: None,
            buckets: vec![Bucket::EMPTY; buckets],
            cells: vec![Cell::FREE; cells],
            committed: probes.clone(),
            probes,
            visibility: None,
            changed_buckets: BTreeSet::new(),
            changed_cells: BTreeSet::new(),
            removed: false,
        }
    }

    fn empty(&mut self) {
        self.buckets.fill(Bucket::EMPTY);
        self.cells.fill(Cell::FREE);
        self.probes.fill(Probe::ABSENT);
        self.visibility = None;
    }

    /// Changes probes here and there.
    fn volume(
        &mut self,
        u: &mut Unstructured<'_>,
        volume: &Volume,
        keyframe: bool,
    ) -> Result<VolumeContent> {
        for _ in 0..u.int_in_range(0..=6)? {
            let at = u.choose_index(self.probes.len())?;
            let probe = &mut self.probes[at];
            if probe.level == 0 || u.arbitrary()? {
                *probe = volumes::probe(u, volume)?;
            } else {
                let code = u.choose_index(volumes::used(probe.level))?;
                probe.codes[code] = volumes::code(u, volume, code)?;
            }
        }
        let sent = volume.visibility.side > 0 && u.ratio(1, 3)?;
        let visibility = match sent {
            true => Some(volumes::visibility(u, volume)?),
            false => None,
        };
        if keyframe || sent {
            self.visibility.clone_from(&visibility);
        }
        Ok(VolumeContent {
            track: self.track.id,
            base: self.committed.clone(),
            probes: self.probes.clone(),
            visibility,
        })
    }

    /// Frees a cell, fills one, moves one to another key, or changes its points.
    fn change(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let grid = *self.track.grid().expect("points");
        let index = u.int_in_range(0..=grid.cell_capacity - 1)?;
        let mut cell = self.cells[index as usize];
        let (free, moved) = (u.ratio(1, 5)?, u.ratio(1, 5)?);
        if cell.key != EMPTY && (free || moved) {
            self.unname(index, cell.key);
        }
        if free {
            cell = Cell::FREE;
        } else {
            if cell.key == EMPTY || moved {
                cell.key = u.int_in_range(0..=(grid.volume() - 1) as u32)?;
                // A full bucket leaves the cell without a name, which is allowed.
                self.name(index, cell.key);
            }
            let there = 1u32 << (grid.widths.bits() - 1);
            let used = u.int_in_range(0..=CELL_POINTS)?;
            cell.points = [0; CELL_POINTS];
            for point in &mut cell.points[..used] {
                *point = there | u.arbitrary::<u32>()? & (there - 1);
            }
        }
        self.cells[index as usize] = cell;
        self.changed_cells.insert(index);
        Ok(())
    }

    fn name(&mut self, index: u32, key: u32) {
        let bucket = self.track.grid().expect("points").bucket_of_key(key);
        let entries = &mut self.buckets[bucket as usize].0;
        if let Some(at) = entries.iter().position(|&e| e == EMPTY) {
            entries[at] = index;
            self.changed_buckets.insert(bucket);
        }
    }

    fn unname(&mut self, index: u32, key: u32) {
        let bucket = self.track.grid().expect("points").bucket_of_key(key);
        let entries = &mut self.buckets[bucket as usize].0;
        if let Some(at) = entries.iter().position(|&e| e == index) {
            entries.copy_within(at + 1.., at);
            entries[BUCKET_ENTRIES - 1] = EMPTY;
            self.changed_buckets.insert(bucket);
        }
    }

    fn content(&mut self, keyframe: bool) -> Content {
        let mut buckets = std::mem::take(&mut self.changed_buckets);
        let mut cells = std::mem::take(&mut self.changed_cells);
        if keyframe {
            let used = (0..)
                .zip(&self.buckets)
                .filter(|(_, b)| **b != Bucket::EMPTY);
            buckets = used.map(|(index, _)| index).collect();
            let used = (0..).zip(&self.cells).filter(|(_, c)| **c != Cell::FREE);
            cells = used.map(|(index, _)| index).collect();
        }
        Content {
            track: self.track.id,
            buckets: buckets.iter().map(|&i| self.buckets[i as usize]).collect(),
            bucket_indices: buckets.into_iter().collect(),
            cells: cells.iter().map(|&i| self.cells[i as usize]).collect(),
            cell_indices: cells.into_iter().collect(),
        }
    }

    fn shown(&self) -> ShownTrack {
        ShownTrack {
            track: self.track.clone(),
            transform: self.transform,
            buckets: self.buckets.clone(),
            cells: self.cells.clone(),
            probes: self.probes.clone(),
            visibility: self.visibility.clone(),
        }
    }
}

/// An owned [`probes::Update`].
struct VolumeContent {
    track: u32,
    base: Vec<Probe>,
    probes: Vec<Probe>,
    visibility: Option<Vec<u8>>,
}

impl VolumeContent {
    fn update(&self) -> probes::Update<'_> {
        probes::Update {
            track: self.track,
            base: &self.base,
            probes: &self.probes,
            visibility: self.visibility.as_deref(),
        }
    }
}

/// An owned [`Update`].
struct Content {
    track: u32,
    bucket_indices: Vec<u32>,
    buckets: Vec<Bucket>,
    cell_indices: Vec<u32>,
    cells: Vec<Cell>,
}

impl Content {
    fn update(&self) -> Update<'_> {
        Update {
            track: self.track,
            bucket_indices: &self.bucket_indices,
            buckets: &self.buckets,
            cell_indices: &self.cell_indices,
            cells: &self.cells,
        }
    }
}
