//! Foliage that attenuates rays in place of stopping them (section 2.1): shrubs are boxes of a density, trees are
//! semi-transparent.
//!
//! - [`classify()`]: which meshes are shrubs or trees.
//! - [`attenuate`]: how much of a ray they let through.
//!
//! It is off unless asked for: an [`super::Obscurance`] without [`super::Obscurance::with_foliage`] traces foliage as the
//! triangles that it is. With it, the tracer has to be of the scene without foliage:
//!
//! ```no_run
//! # use dapple::obscurance::{Kernel, Obscurance, foliage};
//! # use dapple::trace::Tracer;
//! # fn f(scene: dapple::scene::Scene, kernels: &[Kernel]) -> dapple::Result<()> {
//! let pose = scene.pose(0.0);
//! let kinds = foliage::classify(&scene, &pose, &foliage::Rules::default());
//! let foliage = foliage::Foliage::new(&scene, &pose, &kinds, foliage::DENSITY)?;
//! let attenuation = foliage.attenuation();
//! let tracer = Tracer::new(&scene, &foliage.without(&pose));
//! let obscurance = Obscurance::new(&scene, &tracer, kernels, 256)?.with_foliage(&attenuation);
//! # Ok(())
//! # }
//! ```

pub mod attenuate;
pub mod classify;

pub use attenuate::{Attenuation, DENSITY, Foliage, Met, without};
pub use classify::{Kind, Reason, Rules, Verdict, classify};
