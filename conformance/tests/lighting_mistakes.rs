//! The query vectors of `probes` against samplers with a mistake: each mistake must show.

use std::f64::consts::PI;

use dapple_codec::{Decoder, TrackState};
use dapple_conformance::generate;
use dapple_conformance::models::Query;
use dapple_conformance::models::probes::oracle::{self, CONSTANTS};
use dapple_conformance::models::probes::queries::Interpolation;
use dapple_conformance::models::probes::queries::ProbesQuery;
use dapple_conformance::reference;
use dapple_conformance::vector::{Kind, Vector};

/// An enum, and a list of all its variants.
macro_rules! listed {
    ($(#[$doc:meta])* enum $name:ident, $all:ident { $($(#[$about:meta])* $variant:ident,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        enum $name { $($(#[$about])* $variant,)* }
        const $all: &[$name] = &[$($name::$variant,)*];
    };
}

listed! {
    /// What a sampler may get wrong.
    enum Mistake, MISTAKES {
        FirstTrack,
        ExponentIgnored,
        AlwaysTrilinear,
        AlwaysResistant,
        /// The nearest probe alone.
        Nearest,
        /// Weights go on beyond the box.
        Extrapolated,
        /// One spacing for all axes.
        SpacingOfX,
        /// z runs fastest.
        OrderReversed,
        /// Position and directions are turned into the grid once more.
        TurnedOnceMore,
        AbsentBlack,
        AbsentCounts,
        AbsentNothing,
        AbsentHalved,
        AbsentDoubled,
        AbsentAsUnseen,
        NotDivided,
        NoWrap,
        WrapWithoutFloor,
        WrapNotSquared,
        CosineOfProbe,
        /// Directions to probes from the nearest point of the box.
        CosineClamped,
        NoVisibility,
        UnseenIsZero,
        UnseenHalved,
        UnseenDoubled,
        /// Added to shares, and not their least.
        UnseenAdded,
        NotCubed,
        NoCrush,
        CrushNotSquared,
        NoBias,
        NoNormalBias,
        NoViewBias,
        BiasOfLargest,
        BiasOfX,
        /// The chance of longer distances counts below the mean, too.
        BoundBelowMean,
        NothingSeenHides,
        /// Nothing is seen from a mean of 254 on.
        OpenFrom254,
        /// Nothing is seen from a mean of 255 on.
        OpenFrom255,
        NearestTexel,
        TexelCorners,
        EdgesClamped,
        EdgesWrapped,
        MapTransposed,
        LowerNotFolded,
        FoldWithoutSign,
        /// `sign(0)` is 0.
        SignOfZero,
        /// The spread of means between texels is left out.
        DeviationsAlone,
        MeansAlone,
        NoLeastVariance,
        CodesOver256,
        /// The map of the first probe is that of all.
        FirstMap,
        BasisInOrderXyz,
        /// Functions of odd order change their sign.
        CondonShortley,
        NegativeKept,
        NegativeMirrored,
        NoCosineLobe,
        IrradianceOverPi,
        LobeAlongMirror,
        LobeAlongNormal,
        LeanByRoughness,
        LobeByAlpha,
        LobeOfMirror,
        LobeOfCosine,
        ViewReversed,
        NormalAsGiven,
        ViewAsGiven,
    }
}

use Mistake::*;

type V = [f64; 3];

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn scaled(v: V, s: f64) -> V {
    v.map(|c| c * s)
}

fn sum(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn unit(v: V) -> V {
    scaled(v, 1.0 / dot(v, v).sqrt())
}

/// A sampler over what our decoder holds, with a mistake or none.
struct Sampler<'d> {
    decoder: &'d Decoder,
    live: &'d TrackState,
    mistake: Option<Mistake>,
}

fn f64_from_f16(bits: u16) -> f64 {
    let fraction = f64::from(bits & 1023) / 1024.0;
    let magnitude = match bits >> 10 & 31 {
        0 => fraction / 16384.0,
        exponent => (1.0 + fraction) * f64::from(i32::from(exponent) - 15).exp2(),
    };
    if bits < 0x8000 { magnitude } else { -magnitude }
}

impl Sampler<'_> {
    fn wrong(&self, mistake: Mistake) -> bool {
        self.mistake == Some(mistake)
    }

    fn volume(&self) -> &dapple_codec::probes::Volume {
        self.live.track.volume().expect("a track of probes")
    }

    /// The coefficients of a probe.
    fn light(&self, probe: usize) -> [V; 9] {
        let texels = self.decoder.probes().texels_of(self.live);
        let count = self.volume().count();
        let exponent = if self.wrong(ExponentIgnored) {
            0
        } else {
            self.volume().exponent
        };
        let value = |v: usize| f64_from_f16(texels[v / 4 * count + probe][v % 4]);
        let scale = f64::from(exponent).exp2();
        std::array::from_fn(|lm| [0, 1, 2].map(|c| value(3 * lm + c) * scale))
    }

    fn present(&self, probe: usize) -> bool {
        self.decoder.probes().probes_of(self.live)[probe].level > 0
    }

    /// Mean distance in a direction and its variance about that.
    fn moments(&self, probe: usize, q: V) -> Option<(f64, f64)> {
        let block = self.decoder.probes().visibility_of(self.live)?;
        let n = i32::from(self.volume().visibility.side);
        let range = f64::from(self.volume().visibility.range);
        let probe = if self.wrong(FirstMap) { 0 } else { probe };
        let l1 = q.iter().map(|c| c.abs()).sum::<f64>();
        let (mut u, mut v) = (q[0] / l1, q[1] / l1);
        if q[2] < 0.0 && !self.wrong(LowerNotFolded) {
            let sign = |t: f64| match t < 0.0 && !self.wrong(FoldWithoutSign) {
                true => -1.0,
                false if t == 0.0 && self.wrong(SignOfZero) => 0.0,
                false => 1.0,
            };
            (u, v) = ((1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v));
        }
        if self.wrong(MapTransposed) {
            (u, v) = (v, u);
        }
        let middle = if self.wrong(TexelCorners) { 0.0 } else { 0.5 };
        let [i, j] = [u, v].map(|t| (t + 1.0) / 2.0 * f64::from(n) - middle);
        let [i, j] = match self.wrong(NearestTexel) {
            true => [i.round(), j.round()],
            false => [i, j],
        };
        let (mut mean, mut square, mut deviation) = (0.0, 0.0, 0.0);
        for corner in 0..4 {
            let (right, down) = (corner & 1, corner >> 1);
            let part = |t: f64, high: i32| match high {
                1 => t - t.floor(),
                _ => 1.0 - (t - t.floor()),
            };
            let weight = part(i, right) * part(j, down);
            let (mut i, mut j) = (i.floor() as i32 + right, j.floor() as i32 + down);
            if self.wrong(EdgesWrapped) {
                (i, j) = (i.rem_euclid(n), j.rem_euclid(n));
            } else if self.wrong(EdgesClamped) {
                (i, j) = (i.clamp(0, n - 1), j.clamp(0, n - 1));
            } else {
                if i < 0 || i == n {
                    (i, j) = (i.clamp(0, n - 1), n - 1 - j);
                }
                if j < 0 || j == n {
                    (i, j) = (n - 1 - i, j.clamp(0, n - 1));
                }
            }
            let texel = probe as i32 * n * n + j * n + i;
            let steps = if self.wrong(CodesOver256) {
                256.0
            } else {
                255.0
            };
            let metres = |byte: i32| f64::from(block[byte as usize]) * range / steps;
            let (m, e) = (metres(2 * texel), metres(2 * texel + 1));
            mean += weight * m;
            square += weight * (m * m + e * e);
            deviation += weight * e * e;
        }
        let variance = match () {
            () if self.wrong(DeviationsAlone) => deviation,
            () if self.wrong(MeansAlone) => square - deviation - mean * mean,
            () => square - mean * mean,
        };
        Some((mean, variance))
    }

    fn trust(&self, probe: usize, q: V) -> f64 {
        if !self.present(probe) {
            return match () {
                () if self.wrong(AbsentCounts) => 1.0,
                () if self.wrong(AbsentNothing) => 0.0,
                () if self.wrong(AbsentHalved) => constant("ABSENT") / 2.0,
                () if self.wrong(AbsentDoubled) => constant("ABSENT") * 2.0,
                () if self.wrong(AbsentAsUnseen) => unseen(),
                () => constant("ABSENT"),
            };
        }
        let Some((mean, variance)) = self.moments(probe, q).filter(|_| !self.wrong(NoVisibility))
        else {
            return 1.0;
        };
        let range = f64::from(self.volume().visibility.range);
        let d = dot(q, q).sqrt();
        let below = match () {
            () if self.wrong(OpenFrom254) => 1.0,
            () if self.wrong(OpenFrom255) => 0.0,
            () => 0.5,
        };
        // The margin is that of rounding: a mean of 255 everywhere is at the range.
        let nothing = range * (1.0 - (below + 1e-9) / 255.0);
        let open = mean > nothing && !self.wrong(NothingSeenHides);
        if open || (d <= mean && !self.wrong(BoundBelowMean)) {
            return 1.0;
        }
        let least = match self.wrong(NoLeastVariance) {
            true => 0.0,
            false => (range / 255.0).powi(2),
        };
        let variance = variance.max(least);
        let bound = variance / (variance + (d - mean).powi(2));
        let share = if self.wrong(NotCubed) {
            bound
        } else {
            bound.powi(3)
        };
        let crushed = (share / crush()).min(1.0);
        let share = match () {
            () if self.wrong(NoCrush) => share,
            () if self.wrong(CrushNotSquared) => share * crushed,
            () => share * crushed * crushed,
        };
        match () {
            () if self.wrong(UnseenIsZero) => share.max(1e-30),
            () if self.wrong(UnseenHalved) => share.max(unseen() / 2.0),
            () if self.wrong(UnseenDoubled) => share.max(unseen() * 2.0),
            () if self.wrong(UnseenAdded) => share + unseen(),
            () => share.max(unseen()),
        }
    }

    /// Irradiance and filtered radiance.
    fn sample(&self, query: &ProbesQuery) -> [V; 2] {
        let volume = self.volume();
        let mut x = query.position.map(|v| f64::from(v) / 65536.0);
        let [mut n, mut v] = [query.normal, query.view].map(|v| v.map(f64::from));
        if !self.wrong(NormalAsGiven) {
            n = unit(n);
        }
        if !self.wrong(ViewAsGiven) {
            v = unit(v);
        }
        if self.wrong(ViewReversed) {
            v = scaled(v, -1.0);
        }
        if self.wrong(TurnedOnceMore) {
            let rows = volume.grid_from_mesh.map(|row| row.map(f64::from));
            let turned = |v: V| rows.map(|[a, b, c, _]| dot([a, b, c], v));
            (x, n, v) = (sum(turned(x), rows.map(|row| row[3])), turned(n), turned(v));
        }
        let visibility_weighted = match query.interpolation {
            Interpolation::VisibilityWeighted => !self.wrong(AlwaysTrilinear),
            Interpolation::Trilinear => self.wrong(AlwaysResistant),
        };
        let mut spacing = volume.spacing.map(f64::from);
        if self.wrong(SpacingOfX) {
            spacing = [spacing[0]; 3];
        }
        let dims = volume.dims.map(i64::from);
        let top = dims.map(|dim| dim as f64 - 1.0);
        let mut at = [0, 1, 2].map(|axis| x[axis] / spacing[axis]);
        let inside = [0, 1, 2].map(|axis| at[axis].clamp(0.0, top[axis]));
        if !self.wrong(Extrapolated) {
            at = inside;
        }
        if self.wrong(Nearest) {
            at = at.map(f64::round);
        }
        let base = [0, 1, 2].map(|axis| inside[axis].min(top[axis] - 0.5).max(0.0).floor());
        let lift = match () {
            () if self.wrong(BiasOfLargest) => spacing.into_iter().fold(0.0, f64::max),
            () if self.wrong(BiasOfX) => spacing[0],
            () => spacing.into_iter().fold(f64::INFINITY, f64::min),
        };
        let none = self.wrong(NoBias);
        let along = |bias: f64, mistake| {
            if none || self.wrong(mistake) {
                0.0
            } else {
                bias
            }
        };
        let biases = [
            along(constant("NORMAL_BIAS"), NoNormalBias),
            along(constant("VIEW_BIAS"), NoViewBias),
        ];
        let lifted = sum(
            x,
            sum(scaled(n, biases[0] * lift), scaled(v, biases[1] * lift)),
        );
        let (mut light, mut total) = ([[0.0; 3]; 9], 0.0);
        for corner in 0..8usize {
            let (mut place, mut weight) = ([0; 3], 1.0);
            for axis in 0..3 {
                let high = (corner >> axis & 1) as f64;
                let f = at[axis] - base[axis];
                weight *= if high == 1.0 { f } else { 1.0 - f };
                place[axis] = ((base[axis] + high).min(top[axis])) as i64;
            }
            let index = match self.wrong(OrderReversed) {
                true => place[2] + dims[2] * (place[1] + dims[1] * place[0]),
                false => place[0] + dims[0] * (place[1] + dims[1] * place[2]),
            } as usize;
            let probe = [0, 1, 2].map(|axis| place[axis] as f64 * spacing[axis]);
            if visibility_weighted {
                let from = match self.wrong(CosineClamped) {
                    true => [0, 1, 2].map(|axis| inside[axis] * spacing[axis]),
                    false => x,
                };
                let to = sum(probe, scaled(from, -1.0));
                let distance = dot(to, to).sqrt();
                let cosine = if distance > 0.0 {
                    dot(to, n) / distance
                } else {
                    1.0
                };
                let half = if self.wrong(CosineOfProbe) {
                    0.5 - 0.5 * cosine
                } else {
                    0.5 + 0.5 * cosine
                };
                let floor = constant("WRAP");
                weight *= match () {
                    () if self.wrong(NoWrap) => 1.0,
                    () if self.wrong(WrapWithoutFloor) => half * half,
                    () if self.wrong(WrapNotSquared) => half + floor,
                    () => half * half + floor,
                };
                weight *= self.trust(index, sum(lifted, scaled(probe, -1.0)));
            }
            total += weight;
            let dark = self.wrong(AbsentBlack) && !self.present(index);
            for (sum_, own) in light.iter_mut().zip(self.light(index)) {
                *sum_ = sum(*sum_, scaled(own, if dark { 0.0 } else { weight }));
            }
        }
        if visibility_weighted && !self.wrong(NotDivided) {
            light = light.map(|c| scaled(c, if total > 0.0 { 1.0 / total } else { 0.0 }));
        }
        let r = f64::from(query.roughness) / 65536.0;
        let a = if self.wrong(LeanByRoughness) {
            r
        } else {
            r * r
        };
        let mirror = sum(scaled(n, 2.0 * dot(n, v)), scaled(v, -1.0));
        let g = match () {
            () if self.wrong(LobeAlongMirror) => 1.0,
            () if self.wrong(LobeAlongNormal) => 0.0,
            () => (1.0 - a) * ((1.0 - a).sqrt() + a),
        };
        let h = unit(sum(scaled(n, 1.0 - g), scaled(mirror, g)));
        let at = if self.wrong(LobeByAlpha) { r * r } else { r };
        let lobes = match () {
            () if self.wrong(LobeOfMirror) => [1.0; 3],
            () if self.wrong(LobeOfCosine) => [1.0, 2.0 / 3.0, 0.25],
            () => [1.0, 0.8 - 2.0 * at / 15.0, 0.5 - at / 4.0],
        };
        let mut cosine = [PI, 2.0 * PI / 3.0, PI / 4.0];
        if self.wrong(NoCosineLobe) {
            cosine = [PI; 3];
        }
        if self.wrong(IrradianceOverPi) {
            cosine = cosine.map(|a| a / PI);
        }
        [(cosine, n), (lobes, h)].map(|(factors, d)| {
            let mut basis = oracle::basis(d);
            if self.wrong(BasisInOrderXyz) {
                (basis[1], basis[2], basis[3]) = (basis[3], basis[1], basis[2]);
            }
            if self.wrong(CondonShortley) {
                for lm in [1, 3, 5, 7] {
                    basis[lm] = -basis[lm];
                }
            }
            let value = (0..9).fold([0.0; 3], |value, lm| {
                let degree = [0, 1, 1, 1, 2, 2, 2, 2, 2][lm];
                sum(value, scaled(light[lm], basis[lm] * factors[degree]))
            });
            match () {
                () if self.wrong(NegativeKept) => value,
                () if self.wrong(NegativeMirrored) => value.map(f64::abs),
                () => value.map(|c| c.max(0.0)),
            }
        })
    }
}

/// A constant of the specification.
fn constant(name: &str) -> f64 {
    let mut constants = CONSTANTS.iter();
    constants.find(|c| c.0 == name).expect("a constant").1
}

fn crush() -> f64 {
    constant("CRUSH")
}

fn unseen() -> f64 {
    constant("UNSEEN")
}

/// Vectors with queries of light, and what their streams decode to.
fn decoded() -> Vec<(Vector, Decoder)> {
    let vectors = generate::all().expect("the vectors");
    let queries = vectors
        .into_iter()
        .filter(|v| v.kind == Kind::Queries && v.area == "probes");
    let decode = |vector: Vector| {
        let decoder = reference::decoded(&vector.bytes).expect("a valid stream with its end");
        (vector, decoder)
    };
    queries.map(decode).collect()
}

fn right(decoder: &Decoder, query: &Query, mistake: Option<Mistake>) -> bool {
    let Query::Probes(query_of_probes) = query else {
        return false;
    };
    let mut tracks = decoder.tracks().iter();
    let live = match mistake == Some(FirstTrack) {
        true => tracks.next(),
        false => tracks.find(|live| live.track.id == query_of_probes.track),
    };
    let sampler = Sampler {
        decoder,
        live: live.expect("a live track"),
        mistake,
    };
    query.accepts(sampler.sample(query_of_probes).as_flattened())
}

#[test]
fn each_mistake_of_a_sampler_shows() {
    let decoded = decoded();
    let count: usize = decoded.iter().map(|(v, _)| v.info.queries.len()).sum();
    assert!(
        decoded.len() >= 40 && count >= 500,
        "{} {count}",
        decoded.len()
    );
    let failures = |mistake: Option<Mistake>| {
        let mut names = Vec::new();
        for (vector, decoder) in &decoded {
            let mut queries = vector.info.queries.iter();
            if !queries.all(|query| right(decoder, query, mistake)) {
                names.push(vector.name.as_str());
            }
        }
        names
    };
    assert_eq!(failures(None), [""; 0], "a sampler without a mistake");
    let unseen: Vec<Mistake> = MISTAKES
        .iter()
        .copied()
        .filter(|&mistake| {
            let names = failures(Some(mistake));
            println!("{mistake:?}: {} vectors, {:?}", names.len(), names.first());
            names.is_empty()
        })
        .collect();
    assert_eq!(unseen, [], "mistakes that no query shows");
}
