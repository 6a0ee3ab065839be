//! The WGSL modules of all passes, as they are compiled.

/// A module: its name in messages and its source.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    pub name: &'static str,
    pub source: &'static str,
}

/// Rasterises triangles for the visibility and shadow passes.
pub const RASTER: Shader = Shader {
    name: "raster.wgsl",
    source: include_str!("raster.wgsl"),
};

/// Looks up the AO of `points`.
pub const POINTS: Shader = Shader {
    name: "points.wgsl",
    source: concat!(
        include_str!("../../embed/shaders/wgsl/points.wgsl"),
        include_str!("../../embed/shaders/wgsl/points_buffers.wgsl"),
        include_str!("points.wgsl")
    ),
};

/// Direct light under shadow maps, and indirect light from `probes`.
pub const LIGHT: Shader = Shader {
    name: "light.wgsl",
    source: concat!(
        include_str!("shadow.wgsl"),
        include_str!("../../embed/shaders/wgsl/probes.wgsl"),
        include_str!("../../embed/shaders/wgsl/probes_buffers.wgsl"),
        include_str!("light.wgsl")
    ),
};

/// Looks up the AO of `vertices`.
pub const VERTICES: Shader = Shader {
    name: "vertices.wgsl",
    source: concat!(
        include_str!("../../embed/shaders/wgsl/vertices.wgsl"),
        include_str!("../../embed/shaders/wgsl/vertices_buffers.wgsl"),
        include_str!("vertices.wgsl")
    ),
};

/// All modules.
pub const ALL: [Shader; 4] = [RASTER, POINTS, LIGHT, VERTICES];
