//! Metrics, charts and reports: how accurate a method is, what it costs, how steady it is.
//!
//! - [`metrics`]: error of a picture or of a field of ambient occlusion against its reference
//! - [`ssim`], [`flip`]: the two perceptual metrics they use
//! - [`stability`]: flicker over time, and the reference's own noise
//! - [`ddgi`]: the probe method that `probes` is compared with
//! - [`stress`]: scenes that break light from probes and baked obscurance, each swept over one parameter
//! - [`difference`]: pictures of signed differences
//! - [`light`]: pictures by indirect light from probes, and their scores
//! - [`lobe`]: the glossy lobe against traced light
//! - [`evaluate`]: a stream encoded, decoded and scored
//! - [`mod@reference`]: the per-pixel ray-traced reference and scores against it
//! - [`chart`], [`table`], [`report`]: SVG, CSV, HTML and JSON

pub mod chart;
pub mod ddgi;
pub mod difference;
pub mod evaluate;
pub mod flip;
pub mod light;
pub mod lobe;
pub mod metrics;
pub mod reference;
pub mod report;
pub mod ssim;
pub mod stability;
pub mod stress;
pub mod table;
