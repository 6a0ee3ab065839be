//! Tests of the C interface from Rust. Those from C and C++ are in `test.sh`.

mod header;
mod interface;
mod numbers;
