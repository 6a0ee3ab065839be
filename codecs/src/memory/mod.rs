//! Containers whose memory is bounded and whose failure to get memory is an error.

pub(crate) mod free_ranges;
pub(crate) mod index_set;
pub(crate) mod reserve;
pub(crate) mod sort;
