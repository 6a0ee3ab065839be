//! A bake as a stream: one frame, with tracks of `points`, of `vertices` for values at vertices, and of `instances`
//! for functions of place.

use super::escalate::InstancePoints;
use super::ladder::Rung;
use super::regions::Regions;
use super::{Baked, Plan};
use crate::Result;
use crate::codec::instances::{self, Entry, Form, Table};
use crate::codec::regions;
use crate::codec::vertices::{self, Vertices, dithered, remap};
use crate::codec::{
    Compression, Encoder, EncoderConfig, GroupStart, Limits, LookupSpace, Model, StateDigest,
    Target, Track,
};
use crate::instances::server::table::{Function, table};
use crate::limits::check_tracks;
use crate::points::source::write_keyframe;
use crate::scene::{Mesh, Scene};
use crate::trace::Aabb;
use glam::Vec3;
use std::collections::{BTreeMap, BTreeSet};

/// How a bake is written.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Bits of a value, 8 or 5. With 5 values are dithered.
    pub bits: u8,
    pub compression: Compression,
    /// Limits of the decoders that shall read it.
    pub limits: Limits,
}

/// What a stream carries.
struct Content<'b> {
    tracks: Vec<Track>,
    points: Vec<(u32, &'b InstancePoints)>,
    /// Codes of each `vertices` track, by id.
    vertices: Vec<(u32, Vec<u8>)>,
    instances: Vec<(u32, Table, Vec<Entry>)>,
}

/// How far an instance's function may be from what was fitted, by quantising.
const BOUND: f32 = crate::instances::server::table::BOUND;

/// Refuses a plan of which no decoder reads the stream: with values at all vertices, the most that it can have.
///
/// # Errors
/// `Invalid` for more than the limits allow.
pub fn check(plan: &Plan, options: Options) -> Result<()> {
    let scene = plan.scene();
    let distinct: Vec<Vec<u32>> = scene.meshes.iter().map(distinct_vertices).collect();
    let instances = 0..scene.instances.len();
    let alone = instances.filter(|instance| !plan.is_grouped(*instance));
    let shared = plan.groups.iter().map(|group| group.instances[0]);
    let tracks: Vec<Track> = alone
        .chain(shared)
        .zip(1..)
        .map(|(instance, id)| {
            let mesh = scene.instances[instance].mesh;
            let vertices = declaration(plan, options, &distinct[mesh]);
            track(scene, id, Some(instance), mesh, Model::Vertices(vertices))
        })
        .collect();
    check_tracks(&scene.name, &tracks, &options.limits)
}

/// The bytes of a stream.
///
/// Values stand in the order of distinct vertices: vertices with equal positions and normals have equal
/// values, since the fit welds them.
///
/// # Errors
/// `Invalid` for more than the limits allow; `Codec` for what else a decoder refuses.
pub fn write(
    plan: &Plan,
    baked: &Baked,
    regions: Option<&Regions>,
    options: Options,
) -> Result<(Vec<u8>, usize)> {
    let Content {
        mut tracks,
        points,
        vertices,
        instances,
    } = content(plan, baked, regions.is_some(), options)?;
    let id = tracks.len() as u32 + 1;
    tracks.extend(regions.map(|regions| region_track(id, regions)));
    check_tracks(&plan.scene().name, &tracks, &options.limits)?;
    let mut out = Vec::new();
    let config = EncoderConfig {
        limits: options.limits,
        ..EncoderConfig::default()
    };
    let mut encoder = Encoder::new(config, &mut out)?;
    encoder.group(&mut out, GroupStart::Keyframes)?;
    encoder.tracks(&mut out, &tracks)?;
    let mut digest = StateDigest::new();
    if !points.is_empty() {
        let transforms = points.iter().map(|(id, points)| (*id, points.transform));
        let transforms: Vec<_> = transforms.collect();
        encoder.transforms(&mut out, &transforms, options.compression)?;
        let tracks = points
            .iter()
            .map(|(id, points)| (*id, &points.buckets[..], &points.cells[..]));
        write_keyframe(&mut encoder, tracks, options.compression, &mut out)?;
        for (id, points) in &points {
            digest.points(*id, Some(&points.transform), &points.buckets, &points.cells);
        }
    }
    if !vertices.is_empty() {
        let updates: Vec<vertices::Update> = vertices
            .iter()
            .map(|(track, codes)| vertices::Update {
                track: *track,
                codes,
            })
            .collect();
        encoder.vertices(&mut out, &updates, options.compression)?;
        for update in &updates {
            digest.vertices(update.track, None, &values(update.codes, options.bits));
        }
    }
    if !instances.is_empty() {
        let updates: Vec<instances::Update> = instances
            .iter()
            .map(|(track, _, entries)| instances::Update {
                track: *track,
                entries,
            })
            .collect();
        encoder.instances(&mut out, &updates, options.compression)?;
        for (track, table, entries) in &instances {
            let keys: Vec<u64> = entries.iter().map(|entry| entry.key).collect();
            let signals = usize::from(table.signals.count);
            let codes = entries.iter().flat_map(|entry| &entry.codes[..signals]);
            let step = table.step as i16;
            let values: Vec<instances::Value> = codes.map(|c| c.map(|code| code * step)).collect();
            digest.instances(*track, None, &keys, &values);
        }
    }
    if let Some(Regions { content, .. }) = regions {
        let update = regions::Update {
            track: id,
            regions: &content.regions,
            pairs: &content.pairs,
        };
        encoder.regions(&mut out, &[update], options.compression)?;
        digest.regions(id, None, &content.regions, &content.pairs);
    }
    encoder.commit(&mut out, 0, Some(digest.finish()))?;
    encoder.end(&mut out)?;
    Ok((out, tracks.len()))
}

/// Tracks of points, then those of local values, then those of instances with values of their own, then a table for each mesh whose
/// instances have functions. Where there are regions, instances that move or deform have nothing: regions light them.
fn content<'b>(
    plan: &Plan,
    baked: &'b Baked,
    has_regions: bool,
    options: Options,
) -> Result<Content<'b>> {
    let scene = plan.scene();
    let is_static = |instance: usize| !(has_regions && scene.can_move(instance));
    let mut content = Content {
        tracks: Vec::new(),
        points: Vec::new(),
        vertices: Vec::new(),
        instances: Vec::new(),
    };
    let points = baked.points.iter().filter(|points| {
        baked.choices[points.instance].rung == Rung::Points && is_static(points.instance)
    });
    for points in points {
        let id = content.tracks.len() as u32 + 1;
        let track = points.track.clone();
        content.tracks.push(Track { id, ..track });
        content.points.push((id, points));
    }
    let own = baked.choices.iter().enumerate();
    let own = own.filter(|(i, choice)| choice.rung == Rung::Vertices && is_static(*i));
    let own = own.map(|(i, _)| {
        let fitted = baked.choices[i].fitted.as_ref();
        let signals = fitted.unwrap_or(&baked.instances[i].vertices);
        (Some(i), scene.instances[i].mesh, signals)
    });
    let all = scene.instances.iter().zip(&baked.choices).enumerate();
    let with_local = all.filter(|(i, (_, choice))| choice.rung.has_local() && is_static(*i));
    let with_local: BTreeSet<usize> = with_local.map(|(_, (i, _))| i.mesh).collect();
    let shared = baked
        .locals
        .iter()
        .filter(|local| with_local.contains(&local.mesh));
    let shared = shared.map(|local| (None, local.mesh, &local.signals));
    let mut distinct_of_mesh: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    for (instance, mesh, signals) in shared.chain(own) {
        let id = content.tracks.len() as u32 + 1;
        let distinct = distinct_of_mesh.entry(mesh);
        let distinct = distinct.or_insert_with(|| distinct_vertices(&scene.meshes[mesh]));
        let model = Model::Vertices(declaration(plan, options, distinct));
        content.tracks.push(track(scene, id, instance, mesh, model));
        content
            .vertices
            .push((id, codes(distinct, signals, options.bits)));
    }
    // Equal meshes share a table.
    let mut functions: BTreeMap<u64, (usize, Vec<Function>)> = BTreeMap::new();
    let all = scene.instances.iter().zip(&baked.choices).enumerate();
    for (_, (instance, choice)) in all.filter(|(i, _)| is_static(*i)) {
        let form = match choice.rung {
            Rung::Scalar | Rung::LocalScalar => Form::Scalar,
            Rung::Linear | Rung::LocalLinear => Form::Linear,
            Rung::Local | Rung::Vertices | Rung::Points => continue,
        };
        let of_mesh = functions.entry(scene.mesh_hash(instance.mesh));
        let (_, of_mesh) = of_mesh.or_insert_with(|| (instance.mesh, Vec::new()));
        let coefficients = choice.functions.iter();
        of_mesh.push(Function {
            key: instances::key(&instance.name),
            form,
            coefficients: coefficients.map(|f| f.map(|c| c as f32)).collect(),
        });
    }
    let mut of_meshes: Vec<(usize, Vec<Function>)> = functions.into_values().collect();
    of_meshes.sort_by_key(|(mesh, _)| *mesh);
    for (mesh, functions) in of_meshes {
        let coding = instances::Coding::Packed;
        if let Some((table, entries)) = table(plan.settings().block(), &functions, BOUND, coding)? {
            let id = content.tracks.len() as u32 + 1;
            let model = Model::Instances(table);
            content.tracks.push(track(scene, id, None, mesh, model));
            content.instances.push((id, table, entries));
        }
    }
    Ok(content)
}

/// The track of regions, whose space is the world.
fn region_track(id: u32, regions: &Regions) -> Track {
    let boxes = regions.content.regions.iter();
    let boxes = boxes.map(|region| (Vec3::from(region.min), Vec3::from(region.max)));
    let all = boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let (min, max) = all.unwrap_or_default();
    Track {
        id,
        target: Target::default(),
        aabb_min: min.to_array(),
        aabb_max: max.to_array(),
        space: LookupSpace::Mesh,
        model: Model::Regions(regions.set),
    }
}

/// A track of an instance, or of all instances of a mesh.
fn track(scene: &Scene, id: u32, instance: Option<usize>, mesh: usize, model: Model) -> Track {
    let Aabb { min, max } = Aabb::of(scene.meshes[mesh].positions.iter().copied());
    Track {
        id,
        target: Target {
            application_id: 0,
            path: instance.map_or(String::new(), |i| scene.instances[i].name.clone()),
            content_hash: Some(scene.mesh_hash(mesh)),
        },
        aabb_min: min.to_array(),
        aabb_max: max.to_array(),
        space: LookupSpace::Mesh,
        model,
    }
}

fn declaration(plan: &Plan, options: Options, distinct: &[u32]) -> Vertices {
    Vertices {
        signals: plan.settings().block(),
        count: distinct.iter().max().map_or(0, |last| last + 1),
        bits: options.bits,
        order: Vertices::DISTINCT_ORDER,
        coding: vertices::Coding::Packed,
    }
}

/// The distinct vertex of each vertex of a mesh.
fn distinct_vertices(mesh: &Mesh) -> Vec<u32> {
    remap(
        bytemuck::cast_slice(&mesh.positions),
        bytemuck::cast_slice(&mesh.normals),
    )
}

/// The codes of the distinct vertices of a mesh, signals side by side.
fn codes(distinct: &[u32], signals: &[Vec<u8>], bits: u8) -> Vec<u8> {
    let mut next = 0;
    let mut codes = Vec::new();
    for (vertex, &distinct) in distinct.iter().enumerate() {
        if distinct == next {
            next += 1;
            codes.extend(signals.iter().map(|signal| match bits {
                8 => signal[vertex],
                bits => dithered(f32::from(signal[vertex]) / 255.0, bits, distinct),
            }));
        }
    }
    codes
}

/// The values that a decoder makes of codes.
fn values(codes: &[u8], bits: u8) -> Vec<u8> {
    let value = |code: &u8| match bits {
        8 => *code,
        _ => ((u32::from(*code) * 255 + 15) / 31) as u8,
    };
    codes.iter().map(value).collect()
}
