//! Animation channels, and the choice of the animations that play.

use super::hierarchy::Order;
use super::nodes::unit;
use super::{Document, Read, clean_name, find_named, get};
use crate::scene::{Channel, ChannelValues, Interpolation, Scene};
use ::gltf::json;
use json::animation::Property;
use json::validation::Checked;
use std::collections::HashSet;

/// Fills `scene.channels` and `scene.duration`: with the animation that is chosen, or with each that
/// drives no property of an earlier one.
pub(super) fn read(document: &Document, order: &Order, scene: &mut Scene) -> Read<()> {
    let animations = &document.root.animations;
    let names: Vec<String> = (0..animations.len())
        .map(|i| clean_name(animations[i].name.as_ref(), "animation ", i))
        .collect();
    if let Some(wanted) = &document.options.animation {
        let chosen = find_named(wanted, &names, "animation")?;
        let channels = read_animation(document, order, scene, chosen);
        if channels.is_empty() {
            document.warn(format!("animation {} moves nothing", names[chosen]));
        }
        play(scene, channels);
        return Ok(());
    }
    let mut driven = HashSet::new();
    let (mut playing, mut left_out) = (Vec::new(), Vec::new());
    for (i, name) in names.iter().enumerate() {
        let channels = read_animation(document, order, scene, i);
        if channels.is_empty() {
            continue;
        }
        let targets: Vec<_> = channels.iter().map(target).collect();
        if targets.iter().any(|t| driven.contains(t)) {
            left_out.push(name.as_str());
            continue;
        }
        driven.extend(targets);
        playing.push(name.as_str());
        play(scene, channels);
    }
    if !left_out.is_empty() {
        document.warn(format!(
            "animations overlap (they drive the same nodes): {} plays, {} does not; another is chosen \
             by its name",
            list(&playing),
            list(&left_out)
        ));
    } else if playing.len() > 1 {
        document.warn(format!(
            "{} animations play together, without overlap: {}; one is chosen by its name",
            playing.len(),
            list(&playing)
        ));
    }
    Ok(())
}

/// Names for a message, not too many.
fn list(names: &[&str]) -> String {
    const MOST: usize = 16;
    let mut text = names[..names.len().min(MOST)].join(", ");
    if names.len() > MOST {
        text += &format!(" and {} more", names.len() - MOST);
    }
    text
}

fn play(scene: &mut Scene, channels: Vec<Channel>) {
    for channel in &channels {
        let last = channel.times.last().copied().unwrap_or(0.0);
        scene.duration = scene.duration.max(last);
    }
    scene.channels.extend(channels);
}

/// Which property of which node a channel drives.
fn target(channel: &Channel) -> (usize, std::mem::Discriminant<ChannelValues>) {
    (channel.node, std::mem::discriminant(&channel.values))
}

fn read_animation(
    document: &Document,
    order: &Order,
    scene: &mut Scene,
    index: usize,
) -> Vec<Channel> {
    let animation = &document.root.animations[index];
    let numbered = animation.channels.iter().enumerate();
    let channels = numbered.filter_map(|(c, channel)| {
        let what = format!("channel {c} of animation {index}");
        let channel = read_channel(document, order, scene, animation, channel, &what);
        document.optional(channel).flatten()
    });
    channels.collect()
}

/// `None` for a channel that has no effect.
fn read_channel(
    document: &Document,
    order: &Order,
    scene: &mut Scene,
    animation: &json::Animation,
    channel: &json::animation::Channel,
    what: &str,
) -> Read<Option<Channel>> {
    let root = &document.root;
    if channel.target.node.value() == u32::MAX as usize {
        // glTF 2.0, section 3.11: a channel without a node is to be ignored.
        return Ok(None);
    }
    let sampler = get(&animation.samplers, channel.sampler, "animation sampler")
        .map_err(|e| format!("{what}: {e}"))?;
    let target = get(&root.nodes, channel.target.node, "animated node")
        .map_err(|e| format!("{what}: {e}"))?;
    let node = order.of_source[channel.target.node.value()];
    let interpolation = match &sampler.interpolation {
        Checked::Valid(json::animation::Interpolation::Step) => Interpolation::Step,
        Checked::Valid(json::animation::Interpolation::Linear) => Interpolation::Linear,
        Checked::Valid(json::animation::Interpolation::CubicSpline) => Interpolation::Cubic,
        Checked::Invalid => return Err(format!("{what} has an unknown interpolation")),
    };
    let Checked::Valid(property) = &channel.target.path else {
        let text = format!("{what} moves a property that is not known and was left out");
        scene.warnings.push(text);
        return Ok(None);
    };
    let is_weights = *property == Property::MorphTargetWeights;
    if scene.nodes[node].matrix.is_some() && !is_weights {
        return Err(format!(
            "{what} moves a node whose matrix is no translation, rotation and scale"
        ));
    }
    let count = document.count(sampler.input, what)?;
    document.spend(count, what)?;
    let times: Vec<f32> = document
        .floats::<1>(sampler.input, &format!("the times of {what}"))?
        .into_iter()
        .map(|[t]| t)
        .collect();
    if times.is_empty() {
        return Ok(None);
    }
    if times.windows(2).any(|t| t[1] < t[0]) || times[0] < 0.0 {
        return Err(format!("the times of {what} are negative or not in order"));
    }
    let values_per_key = match interpolation {
        Interpolation::Cubic => 3,
        _ => 1,
    };
    let place = format!("the values of {what}");
    let expect = |have: usize, each: usize| {
        let want = times
            .len()
            .saturating_mul(values_per_key)
            .saturating_mul(each);
        if have == want {
            Ok(())
        } else {
            Err(format!("{place} are {have} where {want} are needed"))
        }
    };
    let values = match property {
        Property::Translation | Property::Scale => {
            let values = document.floats::<3>(sampler.output, &place)?;
            expect(values.len(), 1)?;
            let values = values.into_iter().map(Into::into).collect();
            match property {
                Property::Translation => ChannelValues::Translation(values),
                _ => ChannelValues::Scale(values),
            }
        }
        Property::Rotation => {
            let values = document.floats::<4>(sampler.output, &place)?;
            expect(values.len(), 1)?;
            let quat = |q| match interpolation {
                // In a spline the tangents are no rotations, and the sum is normalised later.
                Interpolation::Cubic => glam::Quat::from_array(q),
                _ => unit(q),
            };
            ChannelValues::Rotation(values.into_iter().map(quat).collect())
        }
        Property::MorphTargetWeights => {
            let targets = match target.mesh {
                Some(mesh) => get(&root.meshes, mesh, "mesh")?
                    .primitives
                    .first()
                    .and_then(|p| p.targets.as_ref())
                    .map_or(0, Vec::len),
                None => 0,
            };
            if targets == 0 {
                let text = format!("{what} drives morph targets that are not there");
                scene.warnings.push(text);
                return Ok(None);
            }
            let values = document.floats::<1>(sampler.output, &place)?;
            expect(values.len(), targets)?;
            document.spend(values.len(), what)?;
            ChannelValues::MorphWeights {
                targets,
                values: values.into_iter().map(|[v]| v).collect(),
            }
        }
    };
    Ok(Some(Channel {
        node,
        interpolation,
        times,
        values,
    }))
}
