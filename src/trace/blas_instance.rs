//! An instance of a hierarchy: its transform from world space into mesh space.

use super::aabb::Aabb;
use super::blas::Blas;
use super::slab::SlabRay;
use glam::{Affine3A, DMat3, Vec3};

/// Half a unit in the last place of 1: the relative error of one rounded `f32` operation.
pub(super) const ROUNDING: f32 = f32::EPSILON / 2.0;

/// Roundings, in units of coordinate times condition, between a point as the world knows it and
/// the same point carried into mesh space: six for the subtraction and the matrix, six for the
/// matrix's own entries, times sqrt(3) for a direction across all axes, rounded up.
const ROUNDINGS: f32 = 24.0;

/// Beyond this condition number `f32` cannot tell the transform from a singular one.
const MAX_CONDITION: f64 = 1e6;

/// One instance in the top-level hierarchy.
#[derive(Clone, Debug)]
pub struct BlasInstance {
    /// Its hierarchy, an index into the tracer's.
    pub blas: u32,
    /// Columns of the inverse of the linear part.
    inverse: [[f32; 3]; 3],
    translation: [f32; 3],
    /// Mesh space is world space.
    is_identity: bool,
    /// World space; encloses the mesh as rays in mesh space see it, rounding included.
    pub bounds: Aabb,
    /// The factor by which a world length may grow on the way into mesh space.
    pub stretch: f32,
    /// The same on the way back.
    pub scale: f32,
}

impl BlasInstance {
    /// `None` where the transform is singular or not finite, or the mesh holds nothing: such an
    /// instance is never hit.
    pub fn new(world_from_mesh: &Affine3A, index: u32, blas: &Blas) -> Option<BlasInstance> {
        if !world_from_mesh.is_finite() || blas.bounds().is_empty() {
            return None;
        }
        let (inverse, scale, stretch) = inverse(world_from_mesh)?;
        let condition = scale * stretch;
        let inverse = [inverse.x_axis, inverse.y_axis, inverse.z_axis].map(|c| c.as_vec3());
        if !inverse.iter().all(|c| c.is_finite()) {
            return None;
        }
        let translation = Vec3::from(world_from_mesh.translation);
        let mut bounds = Aabb::EMPTY;
        for b in blas.coarse_boxes() {
            bounds = bounds.union(&b.transformed(world_from_mesh));
        }
        let far = bounds.reach().max(translation.abs().max_element());
        let error = ROUNDINGS * ROUNDING * condition as f32 * far;
        Some(BlasInstance {
            blas: index,
            inverse: inverse.map(|c| c.to_array()),
            translation: translation.to_array(),
            is_identity: *world_from_mesh == Affine3A::IDENTITY,
            bounds: bounds.grown(error),
            stretch: stretch as f32 * (1.0 + 4.0 * f32::EPSILON),
            scale: scale as f32,
        })
    }

    /// How much larger boxes must look to a ray from `origin` (its largest absolute coordinate),
    /// for what rounding may do to the origin on its way into mesh space.
    pub fn slack_per_metre(&self) -> f32 {
        ROUNDINGS * ROUNDING * self.stretch * self.scale
    }

    #[inline(always)]
    pub fn point(&self, p: [f32; 3]) -> [f32; 3] {
        // Subtracting first keeps digits that a product with a large translation would lose.
        let t = &self.translation;
        self.vector([p[0] - t[0], p[1] - t[1], p[2] - t[2]])
    }

    #[inline(always)]
    fn vector(&self, d: [f32; 3]) -> [f32; 3] {
        let [a, b, c] = &self.inverse;
        [
            a[0] * d[0] + b[0] * d[1] + c[0] * d[2],
            a[1] * d[0] + b[1] * d[1] + c[1] * d[2],
            a[2] * d[0] + b[2] * d[1] + c[2] * d[2],
        ]
    }

    /// The ray in mesh space. Its direction is not normalised, so distances stay metres.
    #[inline(always)]
    pub fn ray(&self, world: &SlabRay) -> SlabRay {
        if self.is_identity {
            world.without_slack()
        } else {
            SlabRay::new(self.point(world.origin), self.vector(world.direction), 0.0)
        }
    }
}

/// The inverse of the linear part, and the factors by which that and its inverse stretch at most.
/// `None` where `f32` cannot tell the transform from a singular one.
fn inverse(world_from_mesh: &Affine3A) -> Option<(DMat3, f64, f64)> {
    let linear = DMat3::from_cols(
        world_from_mesh.matrix3.x_axis.as_dvec3(),
        world_from_mesh.matrix3.y_axis.as_dvec3(),
        world_from_mesh.matrix3.z_axis.as_dvec3(),
    );
    let inverse = linear.inverse();
    let (scale, stretch) = (norm(&linear), norm(&inverse));
    // `norm` passes over what is not a number.
    let regular = inverse.is_finite() && scale * stretch <= MAX_CONDITION;
    regular.then_some((inverse, scale, stretch))
}

/// Whether a transform flattens what it places: rays cannot be carried back through it.
pub fn flattens(world_from_mesh: &Affine3A) -> bool {
    world_from_mesh.is_finite() && inverse(world_from_mesh).is_none()
}

/// The factor by which a matrix stretches at most, or a little more: the square root of
/// Gershgorin's bound on the eigenvalues of MᵀM. Exact for a rotation with uniform scale.
fn norm(m: &DMat3) -> f64 {
    let g = m.transpose() * *m;
    [g.x_axis, g.y_axis, g.z_axis]
        .map(|c| c.abs().element_sum())
        .into_iter()
        .fold(0.0, f64::max)
        .sqrt()
}
