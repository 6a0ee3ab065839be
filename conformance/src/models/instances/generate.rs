//! The model `instances`: its parameters, its records and what they leave.

use crate::generate::Draft;

/// Adds the vectors of this part.
///
/// # Errors
/// A sentence that names a vector with a query too near to a threshold.
pub fn add(_drafts: &mut Vec<Draft>) -> Result<(), String> {
    Ok(())
}
