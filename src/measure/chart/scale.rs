//! From values to places on an axis, with ticks at round values.

/// One axis: a range of values and the range of pixels it is drawn to.
pub(super) struct Scale {
    log: bool,
    /// In the axis' own terms: logarithms (base 10) where it is logarithmic.
    from: f64,
    to: f64,
    start: f64,
    end: f64,
    ticks: Vec<(f64, String)>,
}

impl Scale {
    /// An axis over all `values` (finite; positive where `log`) drawn from `start` to `end` with
    /// about `count` ticks and a margin at both ends.
    pub(super) fn new(
        values: impl Iterator<Item = f64>,
        log: bool,
        start: f64,
        end: f64,
        count: usize,
    ) -> Scale {
        let term = |v: f64| if log { v.log10() } else { v };
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values.map(term) {
            from = from.min(v);
            to = to.max(v);
        }
        if from > to {
            (from, to) = (0.0, 1.0);
        }
        // A single value still needs a range around it.
        let least = if log {
            0.3
        } else {
            (from.abs() * 1e-3).max(1e-9)
        };
        if to - from < least {
            let middle = (from + to) / 2.0;
            (from, to) = (middle - least / 2.0, middle + least / 2.0);
        }
        let margin = 0.06 * (to - from);
        // What is never negative gets no negative part of an axis.
        let least = if !log && from >= 0.0 {
            0.0
        } else {
            f64::NEG_INFINITY
        };
        (from, to) = ((from - margin).max(least), to + margin);
        let ticks = if log {
            log_ticks(from, to, count)
        } else {
            linear_ticks(from, to, count)
        };
        Scale {
            log,
            from,
            to,
            start,
            end,
            ticks,
        }
    }

    /// Pixel of a value.
    pub(super) fn place(&self, value: f64) -> f64 {
        let term = if self.log { value.log10() } else { value };
        self.start + (term - self.from) / (self.to - self.from) * (self.end - self.start)
    }

    /// Values with their text, in ascending order.
    pub(super) fn ticks(&self) -> impl Iterator<Item = (f64, &str)> {
        self.ticks
            .iter()
            .map(|(value, text)| (*value, text.as_str()))
    }
}

/// Multiples of 1, 2 or 5 times a power of ten, about `count` of them.
fn linear_ticks(from: f64, to: f64, count: usize) -> Vec<(f64, String)> {
    let rough = (to - from) / count as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * power)
        .find(|step| *step >= rough * 0.7)
        .unwrap_or(10.0 * power);
    let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    let first = (from / step).ceil() as i64;
    let last = (to / step).floor() as i64;
    (first..=last)
        .map(|k| {
            let value = k as f64 * step;
            (value, format!("{value:.decimals$}"))
        })
        .collect()
}

/// 1, 2 and 5 times powers of ten over a short range, powers of ten, or every n-th power over a
/// long one. `from` and `to` are logarithms.
fn log_ticks(from: f64, to: f64, count: usize) -> Vec<(f64, String)> {
    let decades = to - from;
    let multiples: &[f64] = match decades {
        d if d < 1.0 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
        d if d * 3.0 <= count as f64 + 2.0 => &[1.0, 2.0, 5.0],
        _ => &[1.0],
    };
    let stride = (decades / count as f64).ceil().max(1.0) as i32;
    let (first, last) = (from.floor() as i32, to.ceil() as i32);
    let mut ticks = Vec::new();
    for exponent in (first..=last).filter(|e| stride == 1 || e.rem_euclid(stride) == 0) {
        for multiple in multiples {
            let value = multiple * 10f64.powi(exponent);
            if (from..=to).contains(&value.log10()) {
                ticks.push((value, plain(value)));
            }
        }
    }
    ticks
}

/// Short text of a positive round value.
fn plain(value: f64) -> String {
    if (1e-4..1e6).contains(&value) {
        let decimals = (1.0 - value.log10().floor()).max(0.0) as usize;
        let text = format!("{value:.decimals$}");
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_string()
        } else {
            text
        }
    } else {
        format!("{value:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(scale: &Scale) -> Vec<&str> {
        scale.ticks().map(|(_, text)| text).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        let scale = Scale::new([21.3, 35.9].into_iter(), false, 0.0, 100.0, 6);
        assert_eq!(
            texts(&scale),
            ["22", "24", "26", "28", "30", "32", "34", "36"]
        );
        let scale = Scale::new([0.0, 0.052].into_iter(), false, 0.0, 100.0, 6);
        assert_eq!(
            texts(&scale),
            ["0.00", "0.01", "0.02", "0.03", "0.04", "0.05"]
        );
        assert_eq!(scale.place(0.0), 0.0);
    }

    #[test]
    fn log_ticks_are_round() {
        let scale = Scale::new([0.9, 130.0].into_iter(), true, 0.0, 100.0, 8);
        assert_eq!(texts(&scale), ["1", "2", "5", "10", "20", "50", "100"]);
        let scale = Scale::new([1e-9, 1e9].into_iter(), true, 0.0, 100.0, 8);
        assert!(texts(&scale).len() <= 9, "{:?}", texts(&scale));
        let scale = Scale::new([0.02, 0.05].into_iter(), true, 0.0, 100.0, 8);
        assert!(texts(&scale).contains(&"0.03"), "{:?}", texts(&scale));
    }

    #[test]
    fn every_range_has_ticks_within_it_in_order() {
        for (from, to) in [
            (0.0, 0.0),
            (1.0, 1.0),
            (-3.0, 1e6),
            (1e-7, 2e-7),
            (99.9, 100.1),
        ] {
            for log in [false, true] {
                if log && from <= 0.0 {
                    continue;
                }
                let scale = Scale::new([from, to].into_iter(), log, 10.0, 110.0, 6);
                let places: Vec<f64> = scale.ticks().map(|(v, _)| scale.place(v)).collect();
                assert!(!places.is_empty(), "{from} {to} {log}");
                assert!(
                    places.iter().all(|p| (9.99..110.01).contains(p)),
                    "{places:?}"
                );
                assert!(places.is_sorted());
                assert!((10.0..=110.0).contains(&scale.place(from)));
            }
        }
    }
}
