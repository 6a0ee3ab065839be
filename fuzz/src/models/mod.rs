//! The registry of models: what the targets draw, write and check of each. The matches are exhaustive, so
//! that a new model is a compile error here.

pub mod instances;
pub mod points;
pub mod probes;
pub mod regions;
pub mod vertices;

use arbitrary::{Result, Unstructured};
use dapple_codec::{Decoder, Encoder, Model, ModelKind, StateDigest, TrackState, Transform};

/// A track's content.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Buckets and cells.
    Points(points::Content),
    /// Probes and visibility.
    Probes(probes::Content),
    /// Values of vertices.
    Vertices(vertices::Content),
    /// Entries of a table.
    Instances(instances::Content),
    /// Regions and their coefficients.
    Regions(regions::Content),
}

/// A model of any kind with parameters that hold.
pub fn any(u: &mut Unstructured<'_>) -> Result<Model> {
    let kind = *u.choose(&ModelKind::ALL)?;
    of_kind(u, kind)
}

/// A model of a kind with parameters that hold.
pub fn of_kind(u: &mut Unstructured<'_>, kind: ModelKind) -> Result<Model> {
    Ok(match kind {
        ModelKind::Points => Model::Points(points::grid(u)?),
        ModelKind::Probes => Model::Probes(probes::volume(u)?),
        ModelKind::Vertices => Model::Vertices(vertices::track(u)?),
        ModelKind::Instances => Model::Instances(instances::table(u)?),
        ModelKind::Regions => Model::Regions(regions::set(u)?),
    })
}

/// Number, coding and parameters of a model as a track's entry has them, with `scale` times as much state.
pub fn parameters(model: &Model, scale: u32) -> (u16, u16, Vec<u8>) {
    match model {
        Model::Points(grid) => (1, points::coding(grid), points::parameters(grid, scale)),
        Model::Probes(volume) => (2, probes::coding(volume), probes::parameters(volume, scale)),
        Model::Vertices(track) => (
            3,
            vertices::coding(track),
            vertices::parameters(track, scale),
        ),
        Model::Instances(t) => (4, instances::coding(t), instances::parameters(t, scale)),
        Model::Regions(set) => (5, regions::coding(set), regions::parameters(set, scale)),
    }
}

/// The payload of a record of a model, for some of its tracks that `decoder` has.
pub fn payload(u: &mut Unstructured<'_>, kind: ModelKind, decoder: &Decoder) -> Result<Vec<u8>> {
    match kind {
        ModelKind::Points => points::payload(u, decoder),
        ModelKind::Probes => probes::payload(u, decoder),
        ModelKind::Vertices => vertices::payload(u, decoder),
        ModelKind::Instances => instances::payload(u, decoder),
        ModelKind::Regions => regions::payload(u, decoder),
    }
}

/// Checks what holds of the committed content of a model. Returns the bytes of state that it counts.
pub fn check(kind: ModelKind, decoder: &Decoder) -> u64 {
    match kind {
        ModelKind::Points => points::check(decoder),
        ModelKind::Probes => probes::check(decoder),
        ModelKind::Vertices => vertices::check(decoder),
        ModelKind::Instances => instances::check(decoder),
        ModelKind::Regions => regions::check(decoder),
    }
}

/// Content of a frame: changes some tracks of a kind and writes what there is to send.
pub fn write(
    u: &mut Unstructured<'_>,
    kind: ModelKind,
    tracks: Vec<TrackContent<'_>>,
    encoder: &mut Encoder,
    out: &mut Vec<u8>,
) -> Result<()> {
    match kind {
        ModelKind::Points => points::write(u, tracks, encoder, out),
        ModelKind::Probes => probes::write(u, tracks, encoder, out),
        ModelKind::Vertices => vertices::write(u, tracks, encoder, out),
        ModelKind::Instances => instances::write(u, tracks, encoder, out),
        ModelKind::Regions => regions::write(u, tracks, encoder, out),
    }
}

/// A track that a frame has content of.
pub struct TrackContent<'a> {
    /// Its id.
    pub id: u32,
    /// Its parameters.
    pub model: Model,
    /// Its content, to be changed.
    pub content: &'a mut Content,
    /// All of it is sent.
    pub keyframe: bool,
}

impl Content {
    /// That of a new track.
    pub fn empty(model: &Model) -> Content {
        match model {
            Model::Points(grid) => Content::Points(points::Content::empty(grid)),
            Model::Probes(volume) => Content::Probes(probes::Content::empty(volume)),
            Model::Vertices(track) => Content::Vertices(vertices::Content::empty(track)),
            Model::Instances(_) => Content::Instances(instances::Content::default()),
            Model::Regions(_) => Content::Regions(regions::Content::default()),
        }
    }

    /// What a decoder shows of a track.
    pub fn shown(decoder: &Decoder, track: &TrackState) -> Content {
        match &track.track.model {
            Model::Points(_) => Content::Points(points::Content::shown(decoder.points(), track)),
            Model::Probes(_) => Content::Probes(probes::Content::shown(decoder.probes(), track)),
            Model::Vertices(_) => {
                Content::Vertices(vertices::Content::shown(decoder.vertices(), track))
            }
            Model::Instances(_) => {
                Content::Instances(instances::Content::shown(decoder.instances(), track))
            }
            Model::Regions(_) => {
                Content::Regions(regions::Content::shown(decoder.regions(), track))
            }
        }
    }

    /// What a lookup can reach of it.
    pub fn reachable(&self) -> Content {
        match self {
            Content::Points(content) => Content::Points(content.reachable()),
            Content::Probes(content) => Content::Probes(content.clone()),
            Content::Vertices(content) => Content::Vertices(content.clone()),
            Content::Instances(content) => Content::Instances(content.clone()),
            Content::Regions(content) => Content::Regions(content.clone()),
        }
    }

    /// Adds it to a digest.
    pub fn digest(&self, id: u32, transform: Option<&Transform>, digest: &mut StateDigest) {
        match self {
            Content::Points(content) => {
                digest.points(id, transform, &content.buckets, &content.cells);
            }
            Content::Probes(content) => {
                let visibility = content.visibility.as_deref();
                digest.probes(id, transform, &content.probes, visibility);
            }
            Content::Vertices(content) => digest.vertices(id, transform, &content.values),
            Content::Instances(content) => {
                digest.instances(id, transform, &content.keys, &content.values);
            }
            Content::Regions(content) => {
                let arrays = &content.arrays;
                digest.regions(id, transform, &arrays.regions, &arrays.pairs);
            }
        }
    }
}

/// Splits updates of a record into one record or two, and writes each that is not empty.
fn in_records<T>(
    u: &mut Unstructured<'_>,
    updates: &[T],
    mut write: impl FnMut(&mut Unstructured<'_>, &[T]) -> Result<()>,
) -> Result<()> {
    let split = u.int_in_range(0..=updates.len())?;
    for part in [&updates[..split], &updates[split..]] {
        if !part.is_empty() {
            write(u, part)?;
        }
    }
    Ok(())
}
