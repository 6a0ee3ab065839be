//! Packing, hashing and the widths.

use super::*;
use crate::error::ErrorKind;
use crate::models::Parameters as _;
use alloc::vec::Vec;

fn grid(widths: PointWidths) -> Grid {
    Grid {
        grid_from_mesh: [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ],
        dims: [64, 32, 64],
        cell_edge: 0.5,
        radius: 0.25,
        widths,
        bucket_count: 2047,
        cell_capacity: 10,
        coding: Coding::Cells,
    }
}

#[test]
fn presets_have_their_bits() {
    for (widths, bits) in [
        (PointWidths::BITS_32, 32),
        (PointWidths::BITS_24, 24),
        (PointWidths::BITS_16, 16),
    ] {
        assert_eq!(widths.bits(), bits);
        assert_eq!(widths.check(), Ok(()));
    }
    assert!(
        PointWidths {
            position: 5,
            normal: 4,
            ao: 7
        }
        .check()
        .is_err()
    );
}

#[test]
fn the_fields_lie_where_the_specification_says() {
    let w = PointWidths::BITS_32;
    // q = 0, 1, 31; +x is (7, 0); AO 255.
    let point = w.pack([0.0, 1.0 / 32.0, 1.0], [1.0, 0.0, 0.0], 1.0);
    assert_eq!(point, 1 << 31 | 31 << 26 | 1 << 21 | 7 << 8 | 255);
    // -y is (0, -7) = (0, 9 in four bits).
    assert_eq!(w.pack([0.0; 3], [0.0, -1.0, 0.0], 0.0), 1 << 31 | 9 << 12);
}

#[test]
fn codes_survive_a_round_trip() {
    for w in [
        PointWidths::BITS_32,
        PointWidths::BITS_24,
        PointWidths::BITS_16,
    ] {
        let top = 1u32 << (w.bits() - 1);
        let normals = 1u32 << (2 * u32::from(w.normal));
        for q in 0..1u32 << w.position {
            let p = [q, (1 << w.position) - 1 - q, q / 2];
            let bits = u32::from(w.position);
            let position = (p[0] | p[1] << bits | p[2] << (2 * bits)) << (w.ao + 2 * w.normal);
            let code = top | position | (q % (1 << w.ao));
            assert!(w.is_used(code));
            let [x, y, z] = w.unpack_position(code);
            assert_eq!(w.pack([x, y, z], [0.0, 0.0, 1.0], w.unpack_ao(code)), code);
        }
        for code in 0..normals {
            let n = w.normal_of_code(code);
            let again = w.normal_of_code(w.normal_code(w.pack([0.0; 3], n, 0.0)));
            let cosine = n[0] * again[0] + n[1] * again[1] + n[2] * again[2];
            assert!(cosine > 0.999_99, "{code} {n:?} {again:?}");
        }
    }
}

#[test]
fn axis_normals_are_exact() {
    for w in [
        PointWidths::BITS_32,
        PointWidths::BITS_24,
        PointWidths::BITS_16,
    ] {
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let mut n = [0.0; 3];
                n[axis] = sign;
                assert_eq!(w.unpack_normal(w.pack([0.5; 3], n, 0.0)), n);
            }
        }
    }
}

/// Mean and largest angle in degrees between normals and their codes.
fn normal_errors(w: PointWidths) -> (f64, f64) {
    let count = 40_000;
    let (mut sum, mut worst) = (0.0, 0.0f64);
    for i in 0..count {
        // Fibonacci points on the sphere.
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (r, phi) = ((1.0 - z * z).sqrt(), f64::from(i) * 2.399_963_229_728_653);
        let n = [(r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32];
        let m = w.unpack_normal(w.pack([0.0; 3], n, 0.0));
        let cosine: f64 = (0..3).map(|k| f64::from(n[k]) * f64::from(m[k])).sum();
        let angle = cosine.clamp(-1.0, 1.0).acos().to_degrees();
        sum += angle;
        worst = worst.max(angle);
    }
    (sum / f64::from(count), worst)
}

#[test]
fn normals_err_by_what_the_specification_says() {
    let errors: Vec<_> = [
        PointWidths::BITS_32,
        PointWidths::BITS_24,
        PointWidths::BITS_16,
    ]
    .map(normal_errors)
    .into();
    assert!(errors[0].0 < 5.7 && errors[0].1 < 11.4);
    assert!(errors[1].0 < 12.8 && errors[1].1 < 22.4);
    assert!(errors[2].0 < 32.0 && errors[2].1 < 54.8);
}

#[test]
fn positions_and_ao_err_by_half_a_step() {
    let w = PointWidths::BITS_32;
    for i in 0..=1000 {
        let v = i as f32 / 1000.0;
        let point = w.pack([v, 1.0 - v, v * v], [0.0, 1.0, 0.0], v);
        let p = w.unpack_position(point);
        for (got, want) in p.into_iter().zip([v, 1.0 - v, v * v]) {
            assert!((got - want).abs() <= 0.5 / 32.0 + 1e-6);
        }
        assert!((w.unpack_ao(point) - v).abs() <= 0.5 / 255.0 + 1e-6);
    }
    // Outside values are clamped, not wrapped.
    assert_eq!(
        w.unpack_ao(w.pack([9.0, -1.0, f32::NAN], [0.0; 3], 7.0)),
        1.0
    );
}

#[test]
fn keys_and_hashes_agree_with_equation_1() {
    for dims in [[64, 32, 64], [1, 1, 1], [65535, 3, 21845], [3, 65535, 2]] {
        let grid = Grid {
            dims,
            ..grid(PointWidths::BITS_32)
        };
        let hasher = Hasher::new(&grid);
        let [dx, dy, dz] = dims.map(u32::from);
        for i in 0..2000u32 {
            let cell = [i * 7919 % dx, i * 104_729 % dy, i % dz];
            let key = grid.key(cell);
            let [x, y, z] = cell.map(u64::from);
            let (dx, dy) = (u64::from(dx), u64::from(dy));
            assert_eq!(u64::from(key), x + dx * (y + dy * z));
            assert_eq!(grid.cell_of(key), cell);
            let h = (x + y * dx * 17 + z * dx * dy * 31) % (1 << 32);
            assert_eq!(u64::from(grid.hash(cell)), h);
            assert_eq!(u64::from(grid.bucket(cell)), h % 2047);
            assert_eq!(hasher.bucket_of_key(key), grid.bucket(cell));
        }
    }
}

#[test]
fn grids_that_cannot_be_are_refused() {
    let good = grid(PointWidths::BITS_32);
    assert_eq!(good.check(), Ok(()));
    let edge = 2.0 * 0.3f32;
    let short = edge.next_down();
    assert_eq!(
        Grid {
            radius: 0.3,
            cell_edge: short,
            ..good
        }
        .check(),
        Ok(())
    );
    let cases = [
        (
            Grid {
                radius: 0.3,
                cell_edge: short.next_down(),
                ..good
            },
            ErrorKind::GridRadius,
        ),
        (
            Grid {
                radius: 0.0,
                ..good
            },
            ErrorKind::GridRadius,
        ),
        (
            Grid {
                radius: f32::NAN,
                ..good
            },
            ErrorKind::NotFinite,
        ),
        (
            Grid {
                dims: [0, 1, 1],
                ..good
            },
            ErrorKind::GridDims,
        ),
        (
            Grid {
                dims: [65535, 65535, 2],
                ..good
            },
            ErrorKind::GridDims,
        ),
        (
            Grid {
                bucket_count: 0,
                ..good
            },
            ErrorKind::GridCapacity,
        ),
        (
            Grid {
                cell_capacity: EMPTY,
                ..good
            },
            ErrorKind::GridCapacity,
        ),
    ];
    for (grid, fault) in cases {
        assert_eq!(grid.check(), Err(fault), "{grid:?}");
    }
    // 65535 x 65537 would be 2^32 - 1; the largest product that sixteen bits give stays below.
    assert_eq!(
        Grid {
            dims: [65535, 65535, 1],
            ..good
        }
        .check(),
        Ok(())
    );
}
