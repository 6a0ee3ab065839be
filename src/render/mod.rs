//! Pictures: the G-buffer (raster on wgpu, primary rays on the CPU), shading, one pass per method,
//! composite.
pub mod image;
