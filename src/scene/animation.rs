//! Evaluates animation channels (glTF 2.0, section 3.11 and appendix C).

use super::{Channel, ChannelValues, Interpolation};
use glam::{Quat, Vec3};

/// Where a time falls among a channel's keys.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    /// The key at or before the time, and the one after it.
    key: usize,
    next: usize,
    /// Position between them, 0..=1.
    s: f64,
    /// Seconds between them.
    length: f64,
}

/// Finds the span; times outside the keys clamp to the first or last key.
fn find_span(times: &[f32], time: f64) -> Span {
    let after = times.partition_point(|t| f64::from(*t) <= time);
    let last = times.len().saturating_sub(1);
    if after == 0 || after > last {
        let key = if after == 0 { 0 } else { last };
        return Span {
            key,
            next: key,
            s: 0.0,
            length: 0.0,
        };
    }
    let (t0, t1) = (f64::from(times[after - 1]), f64::from(times[after]));
    Span {
        key: after - 1,
        next: after,
        s: (time - t0) / (t1 - t0),
        length: t1 - t0,
    }
}

/// What a channel gives at a time.
pub(super) enum Sample {
    Translation(Vec3),
    Rotation(Quat),
    Scale(Vec3),
    /// Written into the caller's buffer.
    MorphWeights,
}

impl Channel {
    /// The value at `time` seconds; morph weights go to `weights`. `None` for a channel without
    /// keys.
    pub(super) fn sample(&self, time: f64, weights: &mut Vec<f32>) -> Option<Sample> {
        if self.times.is_empty() {
            return None;
        }
        let span = find_span(&self.times, time);
        Some(match &self.values {
            ChannelValues::Translation(values) => {
                Sample::Translation(vec3(self.interpolation, values, span))
            }
            ChannelValues::Scale(values) => Sample::Scale(vec3(self.interpolation, values, span)),
            ChannelValues::Rotation(values) => {
                Sample::Rotation(rotation(self.interpolation, values, span))
            }
            ChannelValues::MorphWeights { targets, values } => {
                weights.clear();
                let at = |key: usize, target: usize| f64::from(values[key * targets + target]);
                weights.extend(
                    (0..*targets).map(|w| blend(self.interpolation, span, |key| at(key, w)) as f32),
                );
                Sample::MorphWeights
            }
        })
    }
}

/// Interpolates one number. `value(i)` is the i-th stored value: one a key, or for cubic splines
/// in-tangent, value and out-tangent of each key.
fn blend(interpolation: Interpolation, span: Span, value: impl Fn(usize) -> f64) -> f64 {
    match interpolation {
        Interpolation::Step => value(span.key),
        Interpolation::Linear => {
            if span.key == span.next {
                return value(span.key);
            }
            let (a, b) = (value(span.key), value(span.next));
            a + (b - a) * span.s
        }
        Interpolation::Cubic => {
            let v0 = value(span.key * 3 + 1);
            if span.key == span.next {
                return v0;
            }
            // Hermite basis; tangents are per second, so they scale with the span (glTF 2.0, C.5).
            let out0 = value(span.key * 3 + 2) * span.length;
            let in1 = value(span.next * 3) * span.length;
            let v1 = value(span.next * 3 + 1);
            let s = span.s;
            let (s2, s3) = (s * s, s * s * s);
            (2.0 * s3 - 3.0 * s2 + 1.0) * v0
                + (s3 - 2.0 * s2 + s) * out0
                + (3.0 * s2 - 2.0 * s3) * v1
                + (s3 - s2) * in1
        }
    }
}

fn vec3(interpolation: Interpolation, values: &[Vec3], span: Span) -> Vec3 {
    let component = |c: usize| blend(interpolation, span, |i| f64::from(values[i][c])) as f32;
    Vec3::new(component(0), component(1), component(2))
}

fn rotation(interpolation: Interpolation, values: &[Quat], span: Span) -> Quat {
    if interpolation == Interpolation::Linear && span.key != span.next {
        return slerp(values[span.key], values[span.next], span.s);
    }
    let q =
        [0, 1, 2, 3].map(|c| blend(interpolation, span, |i| f64::from(values[i].to_array()[c])));
    normalize(q)
}

/// Shortest-arc spherical interpolation in double precision.
fn slerp(a: Quat, b: Quat, s: f64) -> Quat {
    let a = a.to_array().map(f64::from);
    let mut b = b.to_array().map(f64::from);
    let mut cos: f64 = (0..4).map(|i| a[i] * b[i]).sum();
    if cos < 0.0 {
        b = b.map(|x| -x);
        cos = -cos;
    }
    // Below this angle sine is its argument to double precision.
    let (wa, wb) = if cos > 1.0 - 1e-12 {
        (1.0 - s, s)
    } else {
        let angle = cos.min(1.0).acos();
        let inv = 1.0 / angle.sin();
        (((1.0 - s) * angle).sin() * inv, (s * angle).sin() * inv)
    };
    normalize([0, 1, 2, 3].map(|i| wa * a[i] + wb * b[i]))
}

fn normalize(q: [f64; 4]) -> Quat {
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length < 1e-12 {
        return Quat::IDENTITY;
    }
    let [x, y, z, w] = q.map(|v| (v / length) as f32);
    Quat::from_xyzw(x, y, z, w)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(interpolation: Interpolation, times: &[f32], values: ChannelValues) -> Channel {
        Channel {
            node: 0,
            interpolation,
            times: times.to_vec(),
            values,
        }
    }

    fn translation(channel: &Channel, time: f64) -> Vec3 {
        match channel.sample(time, &mut Vec::new()) {
            Some(Sample::Translation(t)) => t,
            _ => panic!("no translation"),
        }
    }

    #[test]
    fn step_holds_linear_blends_and_both_clamp() {
        let values = vec![Vec3::ZERO, Vec3::X, Vec3::Y * 4.0];
        let times = [1.0, 2.0, 4.0];
        let step = channel(
            Interpolation::Step,
            &times,
            ChannelValues::Translation(values.clone()),
        );
        let linear = channel(
            Interpolation::Linear,
            &times,
            ChannelValues::Translation(values),
        );
        for c in [&step, &linear] {
            assert_eq!(translation(c, 0.0), Vec3::ZERO);
            assert_eq!(translation(c, 2.0), Vec3::X);
            assert_eq!(translation(c, 9.0), Vec3::Y * 4.0);
        }
        assert_eq!(translation(&step, 3.99), Vec3::X);
        assert_eq!(translation(&linear, 3.0), Vec3::new(0.5, 2.0, 0.0));
    }

    #[test]
    fn cubic_hits_its_keys_and_its_tangents() {
        let times = [0.0, 0.5, 2.0];
        let (a, b, c) = (Vec3::X, Vec3::new(3.0, 1.0, 0.0), Vec3::Z);
        let slope = Vec3::new(0.0, 8.0, -2.0);
        let cubic = channel(
            Interpolation::Cubic,
            &times,
            ChannelValues::Translation(vec![
                Vec3::ZERO,
                a,
                Vec3::ZERO,
                slope,
                b,
                slope,
                Vec3::ZERO,
                c,
                Vec3::ZERO,
            ]),
        );
        for (time, key) in [(0.0, a), (0.5, b), (2.0, c), (3.0, c)] {
            assert_eq!(translation(&cubic, time), key);
        }
        for h in [-1e-4, 1e-4] {
            let measured = (translation(&cubic, 0.5 + h) - b) / h as f32;
            assert!((measured - slope).length() < 0.02, "{measured}");
        }
    }

    #[test]
    fn slerp_takes_the_short_way_at_constant_speed() {
        let a = Quat::from_rotation_y(0.2);
        let b = -Quat::from_rotation_y(1.4);
        for i in 0..=10 {
            let s = f64::from(i) / 10.0;
            let expected = Quat::from_rotation_y(0.2 + 1.2 * s as f32);
            assert!(slerp(a, b, s).dot(expected).abs() > 1.0 - 1e-6);
        }
    }
}
