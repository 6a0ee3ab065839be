use super::*;
use dapple_codec::points::PointWidths;

/// A small deterministic generator (PCG-XSH-RR without the state dance: a hash of a counter).
pub(crate) struct Random(u32);

impl Random {
    pub(crate) fn new(seed: u32) -> Self {
        Self(seed)
    }
    pub(crate) fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((self.0 >> ((self.0 >> 28) + 4)) ^ self.0).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    }
    pub(crate) fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / (1 << 24) as f32
    }
    pub(crate) fn vec(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }
    pub(crate) fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.vec() * 2.0 - 1.0;
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

pub(crate) const WIDTHS: [PointWidths; 3] = [
    PointWidths {
        position: 5,
        normal: 4,
        ao: 8,
    },
    PointWidths {
        position: 4,
        normal: 3,
        ao: 5,
    },
    PointWidths {
        position: 2,
        normal: 2,
        ao: 5,
    },
];

pub(crate) fn grid(dims: [u16; 3], edge: f32, radius: f32, widths: PointWidths) -> Grid {
    Grid {
        grid_from_mesh: [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ],
        dims,
        cell_edge: edge,
        radius,
        widths,
        bucket_count: 0,
        cell_capacity: 0,
        coding: dapple_codec::points::Coding::Cells,
    }
}

/// A track's state made without the server, and all its points as the client will read them.
pub(crate) struct State {
    pub grid: Grid,
    pub buckets: Vec<Bucket>,
    pub cells: Vec<Cell>,
    pub points: Vec<(Vec3, Vec3, f32)>,
}

pub(crate) fn state(mut grid: Grid, points: &[(Vec3, Vec3, f32)]) -> State {
    let mut cells: Vec<Cell> = Vec::new();
    let mut fill: Vec<usize> = Vec::new();
    let mut ats: Vec<IVec3> = Vec::new();
    let mut read = Vec::new();
    let top = IVec3::from(grid.dims.map(i32::from)) - 1;
    for (position, normal, ao) in points {
        let at = (*position / grid.cell_edge)
            .as_ivec3()
            .clamp(IVec3::ZERO, top);
        let key = grid.key(at.as_uvec3().to_array());
        let free = (0..cells.len()).find(|&i| cells[i].key == key && fill[i] < CELL_POINTS);
        let cell = free.unwrap_or_else(|| {
            cells.push(Cell {
                key,
                points: [0; CELL_POINTS],
            });
            fill.push(0);
            ats.push(at);
            cells.len() - 1
        });
        let local = *position / grid.cell_edge - at.as_vec3();
        let word = grid.widths.pack(local.to_array(), normal.to_array(), *ao);
        cells[cell].points[fill[cell]] = word;
        fill[cell] += 1;
        let p = unpack(&grid, word);
        read.push((p.position + at.as_vec3() * grid.cell_edge, p.normal, p.ao));
    }
    grid.cell_capacity = cells.len() as u32;
    grid.bucket_count = (cells.len() as u32 / 2).max(1) | 1;
    let buckets = loop {
        let mut buckets = vec![Bucket([EMPTY; BUCKET_ENTRIES]); grid.bucket_count as usize];
        let placed = ats.iter().enumerate().all(|(i, at)| {
            let bucket = &mut buckets[grid.bucket(at.as_uvec3().to_array()) as usize].0;
            bucket
                .iter_mut()
                .find(|e| **e == EMPTY)
                .map(|e| *e = i as u32)
                .is_some()
        });
        if placed {
            break buckets;
        }
        grid.bucket_count += 2;
    };
    State {
        grid,
        buckets,
        cells,
        points: read,
    }
}

impl State {
    pub(crate) fn sample(&self, x: Vec3, n: Vec3, fallback: Fallback) -> Sample {
        sample(&self.grid, &self.buckets, &self.cells, x, n, fallback)
    }
}

pub(crate) fn random_state(seed: u32, widths: PointWidths) -> State {
    let mut random = Random::new(seed);
    let dims = [7, 5, 6];
    let edge = 0.2;
    let extent = Vec3::from(dims.map(f32::from)) * edge;
    let radius = edge * (0.3 + 0.2 * random.unit());
    let mut points: Vec<_> = (0..1500)
        .map(|_| (random.vec() * extent, random.direction(), random.unit()))
        .collect();
    // A crowd in one cell: a chain of cells with the same key.
    let crowd = Vec3::new(0.5, 0.5, 0.5);
    points.extend((0..40).map(|_| {
        (
            crowd + random.vec() * 0.08,
            random.direction(),
            random.unit(),
        )
    }));
    state(grid(dims, edge, radius, widths), &points)
}

/// Eq. 2-4 over all points, in f64. `None` when a point is within an epsilon of a threshold.
fn brute_force(state: &State, x: Vec3, n: Vec3) -> Option<(f64, f64)> {
    let r = f64::from(state.grid.radius);
    let (mut weight, mut weighted) = (0.0, 0.0);
    for (p, np, ao) in &state.points {
        let d = p.as_dvec3() - x.as_dvec3();
        let alpha = ((r - d.length()) / r).max(0.0);
        let agreement = np.as_dvec3().dot(n.as_dvec3());
        let slope = np.as_dvec3().dot(d.normalize()).powi(2);
        if alpha > 0.0
            && ((agreement - f64::from(T_N)).abs() < 1e-4 || (slope - f64::from(T_D)).abs() < 1e-3)
        {
            return None;
        }
        if agreement > f64::from(T_N) && slope < f64::from(T_D) {
            weight += alpha;
            weighted += alpha * f64::from(*ao);
        }
    }
    Some((weight, weighted))
}

#[test]
fn agrees_with_all_points_where_the_block_covers_the_sphere() {
    for (seed, widths) in WIDTHS.into_iter().enumerate() {
        let state = random_state(seed as u32, widths);
        let mut random = Random::new(99);
        let (mut checked, mut found) = (0, 0);
        for _ in 0..3000 {
            let extent = Vec3::from(state.grid.dims.map(f32::from)) * state.grid.cell_edge;
            let x = random.vec() * (extent + 0.2) - 0.1;
            let n = random.direction();
            let Some((weight, weighted)) = brute_force(&state, x, n) else {
                continue;
            };
            let sample = state.sample(x, n, Fallback::One);
            assert!(
                (f64::from(sample.weight) - weight).abs() < 1e-4,
                "{sample:?} {weight}"
            );
            if weight > 1e-3 {
                assert!((f64::from(sample.ao) - weighted / weight).abs() < 1e-3);
                found += 1;
            } else if weight == 0.0 {
                assert_eq!((sample.ao, sample.case), (1.0, Case::None));
            }
            checked += 1;
        }
        assert!(checked > 2000 && found > 300, "{checked} {found}");
    }
}

#[test]
fn a_point_at_the_fragment_itself_needs_only_its_normal() {
    let widths = WIDTHS[0];
    let state = state(
        grid([3, 3, 3], 1.0, 0.5, widths),
        &[(Vec3::splat(1.5), Vec3::Z, 0.25)],
    );
    let (p, np, ao) = state.points[0];
    let sample = state.sample(p, np, Fallback::One);
    assert_eq!(
        (sample.weight, sample.points, sample.case),
        (1.0, 1, Case::Found)
    );
    assert!((sample.ao - ao).abs() < 1e-6);
    assert_eq!(state.sample(p, -np, Fallback::Fill).case, Case::None);
    // Straight above it the direction criterion shuts it out, to the side it does not.
    assert_eq!(
        state.sample(p + np * 0.1, np, Fallback::One).case,
        Case::None
    );
    let aside = p + np.any_orthonormal_vector() * 0.1;
    assert_eq!(state.sample(aside, np, Fallback::One).case, Case::Found);
}

#[test]
fn a_constant_field_is_reproduced() {
    for fallback in [Fallback::One, Fallback::Fill] {
        let mut state = random_state(5, WIDTHS[0]);
        let mask = 0xff;
        for word in state.cells.iter_mut().flat_map(|cell| &mut cell.points) {
            if *word != 0 {
                *word = *word & !mask | 100;
            }
        }
        let mut random = Random::new(6);
        for _ in 0..2000 {
            let sample = state.sample(random.vec() * 1.2, random.direction(), fallback);
            if sample.case != Case::None {
                assert!((sample.ao - 100.0 / 255.0).abs() < 2e-6, "{sample:?}");
            }
        }
    }
}

/// Points in a plane, one a cell and so thin that there are gaps between their spheres.
fn thin_plane() -> State {
    let mut random = Random::new(11);
    // Axis directions are exact in any width: all normals are that of the plane.
    let widths = PointWidths {
        position: 6,
        normal: 2,
        ao: 8,
    };
    let points: Vec<_> = (0..256)
        .map(|i| {
            let cell = Vec3::new((i % 16) as f32, (i / 16) as f32, 0.0);
            let p = cell + random.vec() * Vec3::new(1.0, 1.0, 0.0) + Vec3::new(0.0, 0.0, 0.5);
            (
                p * 0.2,
                -Vec3::Z,
                if random.unit() < 0.5 { 0.0 } else { 0.6 },
            )
        })
        .collect();
    state(grid([16, 16, 1], 0.2, 0.1, widths), &points)
}

#[test]
fn the_mend_is_continuous_where_the_paper_jumps() {
    let state = thin_plane();
    let n = state.points[0].1;
    let plane = state.points[0].0.z;
    let jump = |fallback| {
        let at = |i: i32| {
            let s = i as f32 * 1e-5;
            state.sample(Vec3::new(0.3 + s, 0.7 + 0.731 * s, plane), n, fallback)
        };
        let mut last = at(0);
        let (mut most, mut filled) = (0f32, 0);
        for i in 1..200_000 {
            let next = at(i);
            most = most.max((next.ao - last.ao).abs());
            filled += u32::from(next.case == Case::Filled);
            last = next;
        }
        (most, filled)
    };
    let (filled_jump, filled) = jump(Fallback::Fill);
    let (paper_jump, _) = jump(Fallback::One);
    assert!(filled > 100, "the walk crosses gaps: {filled}");
    assert!(paper_jump > 0.3, "{paper_jump}");
    assert!(filled_jump < 0.01, "{filled_jump}");
}

#[test]
fn the_mend_leaves_well_supported_fragments_alone() {
    let state = random_state(8, WIDTHS[0]);
    let mut random = Random::new(9);
    let mut alike = 0;
    for _ in 0..2000 {
        let (x, n) = (random.vec() * 1.1, random.direction());
        let (one, fill) = (
            state.sample(x, n, Fallback::One),
            state.sample(x, n, Fallback::Fill),
        );
        if one.weight >= FILL_WEIGHT {
            assert_eq!(one, fill);
            alike += 1;
        }
        assert_eq!(one.weight, fill.weight);
    }
    assert!(alike > 200, "{alike}");
}

#[test]
fn hostile_state_gives_a_sample_and_no_panic() {
    let mut state = random_state(3, WIDTHS[0]);
    let mut random = Random::new(1);
    for bucket in &mut state.buckets {
        for entry in &mut bucket.0 {
            *entry = random.bits();
        }
    }
    for x in [
        Vec3::splat(f32::NAN),
        Vec3::splat(f32::INFINITY),
        Vec3::splat(-1e30),
        Vec3::ONE,
    ] {
        let sample = state.sample(x, Vec3::Z, Fallback::Fill);
        assert_eq!(sample.ao, 1.0);
    }
    state.grid.bucket_count = 0;
    assert_eq!(
        state.sample(Vec3::ONE, Vec3::Z, Fallback::Fill).case,
        Case::None
    );
    state.grid.bucket_count = 7;
    state.buckets.clear();
    assert_eq!(
        state.sample(Vec3::ONE, Vec3::Z, Fallback::Fill).case,
        Case::None
    );
}

#[test]
fn normals_stay_perpendicular_under_scale_and_mirror() {
    let mut grid = grid([1, 1, 1], 1.0, 0.5, WIDTHS[0]);
    grid.grid_from_mesh = [
        [-2.0, 0.3, 0.0, 1.0],
        [0.0, 0.5, 0.0, 2.0],
        [0.1, 0.0, 3.0, 3.0],
    ];
    let mut random = Random::new(2);
    for _ in 0..100 {
        let n = random.direction();
        let tangent = n.any_orthonormal_vector();
        let (p0, m) = to_grid(&grid, Vec3::ZERO, n);
        let (p1, _) = to_grid(&grid, tangent, n);
        assert!((p1 - p0).dot(m).abs() < 1e-5);
        let (above, _) = to_grid(&grid, n, n);
        assert!((above - p0).dot(m) > 0.0);
    }
}
