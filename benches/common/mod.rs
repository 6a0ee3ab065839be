//! What benchmarks of vertex bakes share.

pub use dapple::bake::surface_points as points;

/// Processor time of all threads so far, 0 where Linux does not tell it: user and system time in
/// hundredths of a second are the 14th and 15th field, the second being a name in parentheses.
pub fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(") ").next().unwrap_or_default();
    let fields = after_name.split(' ').skip(11).take(2);
    fields.filter_map(|f| f.parse::<f64>().ok()).sum::<f64>() / 100.0
}
