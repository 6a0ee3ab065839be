//! What a caller declares of tracks, checked for numbers that do not fit.

use dapple_codec as codec;
use dapple_codec::{instances, points, probes, regions, signals, vertices};

use crate::parameters::{Grid, Parameters, Signals, Volume};

/// A number in fewer bits; none where it does not fit.
fn narrow<N: TryFrom<u32>>(number: u32) -> Option<N> {
    N::try_from(number).ok()
}

fn narrow3(numbers: [u32; 3]) -> Option<[u16; 3]> {
    let [x, y, z] = numbers;
    Some([narrow(x)?, narrow(y)?, narrow(z)?])
}

/// The model that C declares; none where a number does not fit, or there is no such model or coding.
///
/// # Safety
/// All bytes of the member that `model` names are written.
pub(crate) unsafe fn to_model(
    model: u32,
    coding: u32,
    parameters: &Parameters,
) -> Option<codec::Model> {
    let raw = match coding {
        0 => true,
        1 if model > 1 => false,
        _ => return None,
    };
    // SAFETY: the caller's promise. Any bits are a value of these structs.
    unsafe {
        Some(match model {
            1 => codec::Model::Points(parameters.points.to_codec()?),
            2 => codec::Model::Probes(to_volume(&parameters.probes, raw)?),
            3 => {
                let vertices = parameters.vertices;
                codec::Model::Vertices(vertices::Vertices {
                    signals: to_signals(&vertices.signals)?,
                    count: vertices.count,
                    bits: narrow(vertices.bits)?,
                    order: narrow(vertices.order)?,
                    coding: match raw {
                        true => vertices::Coding::Raw,
                        false => vertices::Coding::Packed,
                    },
                })
            }
            4 => {
                let table = parameters.instances;
                codec::Model::Instances(instances::Table {
                    signals: to_signals(&table.signals)?,
                    count: table.count,
                    exponent: narrow(table.exponent)?,
                    step: narrow(table.step)?,
                    coding: match raw {
                        true => instances::Coding::Raw,
                        false => instances::Coding::Packed,
                    },
                })
            }
            5 => {
                let set = parameters.regions;
                codec::Model::Regions(regions::RegionSet {
                    signals: to_signals(&set.signals)?,
                    count: set.count,
                    capacity: set.capacity,
                    exponent: narrow(set.exponent)?,
                    step: narrow(set.step)?,
                    coding: match raw {
                        true => regions::Coding::Raw,
                        false => regions::Coding::Packed,
                    },
                })
            }
            _ => return None,
        })
    }
}

impl Grid {
    /// The grid; none where a number does not fit.
    pub(crate) fn to_codec(self) -> Option<points::Grid> {
        Some(points::Grid {
            grid_from_mesh: bytemuck::cast(self.grid_from_mesh),
            dims: narrow3(self.dims)?,
            cell_edge: self.cell_edge,
            radius: self.radius,
            widths: points::PointWidths {
                position: narrow(self.position_bits)?,
                normal: narrow(self.normal_bits)?,
                ao: narrow(self.ao_bits)?,
            },
            bucket_count: self.bucket_count,
            cell_capacity: self.cell_capacity,
            coding: points::Coding::Cells,
        })
    }
}

fn to_volume(volume: &Volume, raw: bool) -> Option<probes::Volume> {
    Some(probes::Volume {
        grid_from_mesh: bytemuck::cast(volume.grid_from_mesh),
        dims: narrow3(volume.dims)?,
        spacing: volume.spacing,
        exponent: i8::try_from(volume.exponent).ok()?,
        visibility: probes::Visibility {
            side: narrow(volume.visibility_side)?,
            range: volume.visibility_range,
            steps: [
                narrow(volume.visibility_steps[0].into())?,
                narrow(volume.visibility_steps[1].into())?,
            ],
        },
        coding: match raw {
            true => probes::Coding::Raw,
            false => probes::Coding::Packed(probes::Steps {
                luma: narrow3(volume.luma_steps)?,
                chroma: narrow3(volume.chroma_steps)?,
            }),
        },
    })
}

fn to_signals(signals: &Signals) -> Option<signals::Signals> {
    let kernel = |at: usize| {
        Some(signals::Kernel {
            kind: narrow(signals.kinds[at])?,
            distance: signals.distances[at],
        })
    };
    Some(signals::Signals {
        count: narrow(signals.count)?,
        kernels: [kernel(0)?, kernel(1)?],
        share: signals.share,
    })
}
