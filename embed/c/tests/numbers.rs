//! Numbers of the interface are those of the codec, and stay what they are.

use dapple_c::numbers::{self, Class, Layer};
use dapple_codec as codec;
use dapple_codec::{Buffer, Event, Limit, ModelKind};

#[test]
fn buffers_limits_and_models_keep_their_numbers() {
    use numbers::{Buffer as B, Limit as L, Model as M};
    let buffers = [
        (Buffer::PointsBuckets, B::PointsBuckets as u32, 0),
        (Buffer::PointsCells, B::PointsCells as u32, 1),
        (Buffer::ProbesTexels, B::ProbesTexels as u32, 2),
        (Buffer::ProbesVisibility, B::ProbesVisibility as u32, 3),
        (Buffer::VerticesValues, B::VerticesValues as u32, 4),
        (Buffer::InstancesKeys, B::InstancesKeys as u32, 5),
        (Buffer::InstancesValues, B::InstancesValues as u32, 6),
        (Buffer::Regions, B::Regions as u32, 7),
        (Buffer::RegionsPairs, B::RegionsPairs as u32, 8),
        (Buffer::Transforms, B::Transforms as u32, 9),
    ];
    assert_eq!(buffers.map(|(buffer, _, _)| buffer), Buffer::ALL);
    for (buffer, of_c, number) in buffers {
        assert_eq!((buffer.number(), of_c), (number, number), "{buffer:?}");
    }
    let limits = [
        (Limit::StoredBytes, L::StoredBytes as u32, 1),
        (Limit::UnpackedBytes, L::UnpackedBytes as u32, 2),
        (Limit::FrameBytes, L::FrameBytes as u32, 3),
        (Limit::ZstdWindowBytes, L::ZstdWindowBytes as u32, 4),
        (Limit::Tracks, L::Tracks as u32, 5),
        (Limit::PathBytes, L::PathBytes as u32, 6),
        (Limit::StateBytes, L::StateBytes as u32, 7),
        (Limit::WorkPerByte, L::WorkPerByte as u32, 8),
    ];
    assert_eq!(limits.map(|(limit, _, _)| limit), Limit::ALL);
    for (limit, of_c, number) in limits {
        assert_eq!((limit.number(), of_c), (number, number), "{limit:?}");
    }
    let models = [
        (ModelKind::Points, M::Points as u32, 1),
        (ModelKind::Probes, M::Probes as u32, 2),
        (ModelKind::Vertices, M::Vertices as u32, 3),
        (ModelKind::Instances, M::Instances as u32, 4),
        (ModelKind::Regions, M::Regions as u32, 5),
    ];
    assert_eq!(models.map(|(model, _, _)| model), ModelKind::ALL);
    for (model, of_c, number) in models {
        assert_eq!((model.number().into(), of_c), (number, number), "{model:?}");
    }
}

#[test]
fn events_keep_their_numbers() {
    use numbers::Event as E;
    let rate = codec::TickRate::default();
    let start = codec::GroupStart::Keyframes;
    let events = [
        (Event::NeedInput, E::NeedInput as u32, 0),
        (Event::Stream(rate), E::Stream as u32, 1),
        (Event::Group { id: 0, start }, E::Group as u32, 2),
        (Event::Tracks { added: 0 }, E::Tracks as u32, 3),
        (
            Event::Skipped {
                record_type: 0,
                stored_bytes: 0,
            },
            E::Skipped as u32,
            5,
        ),
        (Event::End, E::End as u32, 6),
    ];
    for (event, of_c, number) in events {
        assert_eq!((event.number(), of_c), (number, number), "{event:?}");
    }
    // A frame only comes out of a decoder.
    assert_eq!(E::Frame as u32, 4);
    let stream = include_bytes!("../../../spec/examples/points.dapple");
    let mut seen = Vec::new();
    codec::decode_all(stream, codec::Limits::default(), |_, event| {
        seen.push(event.number());
    })
    .expect("the stream of the specification");
    assert!(seen.contains(&4), "{seen:?}");
}

#[test]
fn classes_and_layers_keep_their_numbers() {
    use codec::ErrorClass as C;
    let classes = [
        (C::Malformed, Class::Malformed as u32, 1),
        (C::Truncated, Class::Truncated as u32, 2),
        (C::Unsupported, Class::Unsupported as u32, 3),
        (C::Checksum, Class::Checksum as u32, 4),
        (
            C::LimitExceeded {
                which: Limit::Tracks,
                asked: 1,
                allowed: 0,
            },
            Class::LimitExceeded as u32,
            5,
        ),
        (C::MissingBase, Class::MissingBase as u32, 6),
        (C::Usage, Class::Usage as u32, 7),
        (C::OutOfMemory, Class::OutOfMemory as u32, 8),
    ];
    for (class, of_c, number) in classes {
        assert_eq!((class.number(), of_c), (number, number), "{class:?}");
    }
    let layers = [
        (codec::Layer::Framing, Layer::Framing as u32, 1),
        (codec::Layer::Record, Layer::Record as u32, 2),
        (codec::Layer::Codec, Layer::Codec as u32, 3),
        (codec::Layer::Session, Layer::Session as u32, 4),
    ];
    for (layer, of_c, number) in layers {
        assert_eq!((layer.number(), of_c), (number, number), "{layer:?}");
    }
}
