//! What tracks of each model declare, as plain structs.

use dapple_codec as codec;
use dapple_codec::{probes, signals};

/// Parameters of a track of `points`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Grid {
    /// Rows of a 3x4 matrix, grid space from mesh space: metres with scale applied.
    pub grid_from_mesh: [f32; 12],
    /// Cells along x, y, z.
    pub dims: [u32; 3],
    /// Edge of a cell in metres.
    pub cell_edge: f32,
    /// Interpolation radius in metres.
    pub radius: f32,
    /// Bits of each of three position coordinates.
    pub position_bits: u32,
    /// Bits of each of two octahedral coordinates.
    pub normal_bits: u32,
    /// Bits of the AO value.
    pub ao_bits: u32,
    /// Number of buckets.
    pub bucket_count: u32,
    /// Cells that the track may hold.
    pub cell_capacity: u32,
    /// Of a decoder: index of its first bucket in `DAPPLE_BUFFER_POINTS_BUCKETS`.
    pub first_bucket: u32,
    /// Of a decoder: index of its first cell in `DAPPLE_BUFFER_POINTS_CELLS`.
    pub first_cell: u32,
}

/// Parameters of a track of `probes`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Volume {
    /// Rows of a 3x4 matrix, grid space from mesh space: metres, rigid, origin at the first probe.
    pub grid_from_mesh: [f32; 12],
    /// Probes along x, y, z.
    pub dims: [u32; 3],
    /// Metres between probes along x, y, z.
    pub spacing: [f32; 3],
    /// A decoded value is a half float times two to this power.
    pub exponent: i32,
    /// Texels along a side of a probe's visibility map; 0 where there is none.
    pub visibility_side: u32,
    /// Metres that a mean distance of 255 stands for; 0 where there is no map.
    pub visibility_range: f32,
    /// Steps of luma for degrees 0, 1 and 2; 0 in the coding 0 (`raw`).
    pub luma_steps: [u32; 3],
    /// Steps of chroma.
    pub chroma_steps: [u32; 3],
    /// Steps of means and of deviations in maps; 0 where there is no map, and in the coding 0 (`raw`).
    pub visibility_steps: [u16; 2],
}

/// What the values of a baked track are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Signals {
    /// Signals of a value: 1 or 2.
    pub count: u32,
    /// Kernel of each: 0 none, 1 exponential, 2 cut-off.
    pub kinds: [u32; 2],
    /// Distance of each kernel in metres.
    pub distances: [f32; 2],
    /// Share of the second kernel, 0 to 1.
    pub share: f32,
}

/// Parameters of a track of `vertices`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Vertices {
    /// What a value is.
    pub signals: Signals,
    /// Vertices.
    pub count: u32,
    /// Bits of a value: 8 or 5.
    pub bits: u32,
    /// Which vertex has which value: 0 as in the file, 1 distinct vertices in order.
    pub order: u32,
    /// Of a decoder: index of its first value in `DAPPLE_BUFFER_VERTICES_VALUES`.
    pub first_value: u32,
}

/// Parameters of a track of `instances`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Instances {
    /// What the values are.
    pub signals: Signals,
    /// Entries.
    pub count: u32,
    /// A coefficient of 32767 is two to this power.
    pub exponent: u32,
    /// Step of the quantiser in 1/32767 of that.
    pub step: u32,
}

/// Parameters of a track of `regions`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Regions {
    /// What the values are.
    pub signals: Signals,
    /// Regions.
    pub count: u32,
    /// Pairs of coefficients that all regions together may have.
    pub capacity: u32,
    /// A coefficient is a value / 32767, times two to this power.
    pub exponent: u32,
    /// A value is a code times this.
    pub step: u32,
}

/// Parameters of a track: the member that its model names.
#[derive(Clone, Copy)]
#[repr(C)]
pub union Parameters {
    /// `DAPPLE_MODEL_POINTS`.
    pub points: Grid,
    /// `DAPPLE_MODEL_PROBES`.
    pub probes: Volume,
    /// `DAPPLE_MODEL_VERTICES`.
    pub vertices: Vertices,
    /// `DAPPLE_MODEL_INSTANCES`.
    pub instances: Instances,
    /// `DAPPLE_MODEL_REGIONS`.
    pub regions: Regions,
}

/// The model of a decoder's track as C has it. A place is filled in by the caller.
pub(crate) fn from_model(model: &codec::Model) -> Parameters {
    match model {
        codec::Model::Points(grid) => Parameters {
            points: Grid {
                grid_from_mesh: flat(&grid.grid_from_mesh),
                dims: grid.dims.map(u32::from),
                cell_edge: grid.cell_edge,
                radius: grid.radius,
                position_bits: grid.widths.position.into(),
                normal_bits: grid.widths.normal.into(),
                ao_bits: grid.widths.ao.into(),
                bucket_count: grid.bucket_count,
                cell_capacity: grid.cell_capacity,
                first_bucket: 0,
                first_cell: 0,
            },
        },
        codec::Model::Probes(volume) => Parameters {
            probes: from_volume(volume),
        },
        codec::Model::Vertices(vertices) => Parameters {
            vertices: Vertices {
                signals: from_signals(&vertices.signals),
                count: vertices.count,
                bits: vertices.bits.into(),
                order: vertices.order.into(),
                first_value: 0,
            },
        },
        codec::Model::Instances(table) => Parameters {
            instances: Instances {
                signals: from_signals(&table.signals),
                count: table.count,
                exponent: table.exponent.into(),
                step: table.step.into(),
            },
        },
        codec::Model::Regions(set) => Parameters {
            regions: Regions {
                signals: from_signals(&set.signals),
                count: set.count,
                capacity: set.capacity,
                exponent: set.exponent.into(),
                step: set.step.into(),
            },
        },
    }
}

fn from_volume(volume: &probes::Volume) -> Volume {
    let (luma_steps, chroma_steps) = match volume.coding {
        probes::Coding::Raw => ([0; 3], [0; 3]),
        probes::Coding::Packed(steps) => (steps.luma.map(u32::from), steps.chroma.map(u32::from)),
    };
    Volume {
        grid_from_mesh: flat(&volume.grid_from_mesh),
        dims: volume.dims.map(u32::from),
        spacing: volume.spacing,
        exponent: volume.exponent.into(),
        visibility_side: volume.visibility.side.into(),
        visibility_range: volume.visibility.range,
        luma_steps,
        chroma_steps,
        visibility_steps: volume.visibility.steps.map(u16::from),
    }
}

fn from_signals(signals: &signals::Signals) -> Signals {
    Signals {
        count: signals.count.into(),
        kinds: signals.kernels.map(|kernel| kernel.kind.into()),
        distances: signals.kernels.map(|kernel| kernel.distance),
        share: signals.share,
    }
}

/// Twelve numbers by rows.
fn flat(rows: &[[f32; 4]; 3]) -> [f32; 12] {
    bytemuck::cast(*rows)
}
