//! Queries to tracks of `instances`: the AO of a place on a mesh instance.

use twox_hash::XxHash64;

use super::{AREA, Content, Draft, Frames, Table};
use crate::generate::draw::Draw;
use crate::models::Query;
use crate::models::entry::Entry;
use crate::models::instances::oracle::{MISTAKES, ao, with_interval};
use crate::models::instances::queries::InstancesQuery;
use crate::models::instances::writer::Instance;

/// A table of paths with what each has, in whatever order.
struct Case<'c> {
    name: &'c str,
    clauses: &'c [&'static str],
    comment: &'c str,
    table: Table,
    aabb: [f32; 6],
    instances: Vec<(&'c str, bool, [[i32; 4]; 2])>,
    /// Paths, positions in 1/65536 m, local AO in 1/65536.
    asked: Vec<(&'c str, [i32; 3], u32)>,
}

const USUAL: [f32; 6] = [-1.0, 0.0, 2.0, 3.0, 0.5, 6.0];
const ONE: u32 = 65536;
const NONE: [i32; 4] = [0; 4];

/// Adds the vectors of this part.
///
/// # Errors
/// A sentence that names a mistake of samplers which no query shows.
pub fn add(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let mut shown = [false; MISTAKES.len()];
    for case in cases() {
        let mut instances: Vec<Instance> = case
            .instances
            .iter()
            .map(|&(path, linear, codes)| Instance {
                key: XxHash64::oneshot(0, path.as_bytes()),
                linear,
                codes,
            })
            .collect();
        instances.sort_by_key(|instance| instance.key);
        let entry = Entry {
            aabb: case.aabb,
            ..Entry::of_table(1, case.table.clone())
        };
        let frames = Frames::new(&[entry]).instances(&[Content::new(1, instances)]);
        let frames = frames.commit();
        let Some(entries) = frames.tracks[0].entries() else {
            continue;
        };
        let query = |&(path, position, local): &(&str, [i32; 3], u32)| {
            let query = InstancesQuery {
                track: 1,
                instance: path.to_string(),
                position,
                local,
                ao: [0; 2],
            };
            with_interval(entries, &case.aabb, query)
        };
        let queries: Vec<InstancesQuery> = case.asked.iter().map(query).collect();
        for (mistake, shown) in MISTAKES.into_iter().zip(&mut shown) {
            *shown |= queries.iter().any(|query| {
                let (wrong, _) = ao(entries, &case.aabb, query, Some(mistake));
                let [low, high] = query.ao.map(|end| f64::from(end) / 65536.0);
                !(low..=high).contains(&wrong)
            });
        }
        let queries = queries.into_iter().map(Query::Instances).collect();
        let bytes = frames.ended();
        drafts.push(Draft::query(
            AREA,
            case.name,
            case.clauses,
            case.comment,
            bytes,
            queries,
        ));
    }
    match MISTAKES.into_iter().zip(shown).find(|(_, shown)| !shown) {
        None => Ok(()),
        Some((mistake, _)) => Err(format!("instances: no query shows {mistake:?}")),
    }
}

/// Places in and about the usual bounds.
fn places(seed: u64, count: usize) -> Vec<[i32; 3]> {
    let mut draw = Draw(seed);
    let mut along = |low: f32, high: f32| {
        let at = f64::from(low) + f64::from(high - low) * (0.5 + 0.6 * draw.signed());
        (at * 65536.0) as i32
    };
    let place = |_| [along(-1.0, 3.0), along(0.0, 0.5), along(2.0, 6.0)];
    (0..count).map(place).collect()
}

fn cases() -> Vec<Case<'static>> {
    let fine = |table: Table| Table { step: 1, ..table };
    let asked = |path: &'static str, seed, local: u32| {
        places(seed, 12).into_iter().map(move |x| (path, x, local))
    };
    vec![
        Case {
            name: "scalar",
            clauses: &["I-060", "I-061", "I-063", "I-064"],
            comment: "Scalars of three paths; their AO is the same everywhere.",
            table: Table::raw(3),
            aabb: USUAL,
            instances: vec![
                ("a", false, [[200, 0, 0, 0], NONE]),
                ("b", false, [[50, 0, 0, 0], NONE]),
                ("c", false, [[120, 0, 0, 0], NONE]),
            ],
            asked: vec![
                ("a", [0, 0, 0], ONE),
                ("b", [0, 0, 0], ONE),
                ("c", [-900_000, 900_000, 65536], ONE),
                ("a", [0, 20_000, 300_000], ONE / 2),
                ("b", [5, 6, 7], 0),
                ("d", [0, 0, 0], ONE),
                ("d", [0, 0, 0], ONE / 4),
                ("", [0, 0, 0], 50_000),
                ("A", [0, 0, 0], 40_000),
            ],
        },
        Case {
            name: "paths",
            clauses: &["I-060"],
            comment: "Paths with spaces and beyond ASCII, some of more than 32 bytes, and an empty one.",
            table: Table::packed(5),
            aabb: USUAL,
            instances: vec![
                ("", false, [[30, 0, 0, 0], NONE]),
                ("forest/tree 7/leaves", false, [[60, 0, 0, 0], NONE]),
                ("höhle/säule", false, [[90, 0, 0, 0], NONE]),
                (
                    "a/path/of/more/than/thirty-two/bytes/so/that/four/lanes/hash",
                    false,
                    [[120, 0, 0, 0], NONE],
                ),
                (
                    "exactly/thirty-two/bytes/of/path",
                    false,
                    [[150, 0, 0, 0], NONE],
                ),
            ],
            asked: [
                "",
                "forest/tree 7/leaves",
                "höhle/säule",
                "a/path/of/more/than/thirty-two/bytes/so/that/four/lanes/hash",
                "exactly/thirty-two/bytes/of/path",
                "forest/tree 7",
            ]
            .map(|path| (path, [0, 0, 0], ONE))
            .to_vec(),
        },
        Case {
            name: "linear",
            clauses: &["I-061", "I-062", "I-063"],
            comment: "A linear entry within its bounds, at their faces, and beyond.",
            table: fine(Table::packed(2)),
            aabb: USUAL,
            instances: vec![
                ("x", true, [[16000, 3000, -5000, 7000], NONE]),
                ("y", true, [[9000, 0, 20000, 0], NONE]),
            ],
            asked: asked("x", 1, ONE)
                .chain(asked("y", 2, 60_000))
                .chain([
                    ("x", [-65536, 0, 2 * 65536], ONE),
                    ("x", [3 * 65536, 32768, 6 * 65536], ONE),
                    ("y", [0, 32768, 0], ONE),
                    ("y", [0, -9_000_000, 0], ONE),
                    ("x", [9_000_000, 9_000_000, 9_000_000], ONE),
                ])
                .collect(),
        },
        Case {
            name: "exponents",
            clauses: &["I-061", "I-064"],
            comment: "With the exponent 3 a G above 1 brightens a dark local AO, up to 1.",
            table: Table {
                exponent: 3,
                step: 1,
                ..Table::raw(2)
            },
            aabb: USUAL,
            instances: vec![
                ("bright", true, [[12000, 1000, 0, -800], NONE]),
                ("dim", true, [[900, 300, 200, 100], NONE]),
            ],
            asked: asked("bright", 3, 15_000)
                .chain(asked("bright", 4, ONE))
                .chain(asked("dim", 5, 50_000))
                .collect(),
        },
        Case {
            name: "two-signals",
            clauses: &["O-010", "I-063"],
            comment: "Two signals, each kept above 0, and their blend.",
            table: fine(Table::packed(3)).of_two(),
            aabb: USUAL,
            instances: vec![
                ("a", true, [[20000, 5000, 0, 0], [8000, 0, -6000, 1000]]),
                ("b", false, [[30000, 0, 0, 0], [4000, 0, 0, 0]]),
                ("c", true, [[-2000, 9000, 9000, 0], [6000, -9000, 0, 9000]]),
            ],
            asked: asked("a", 6, ONE)
                .chain(asked("b", 7, 33_000))
                .chain(asked("c", 8, ONE))
                .collect(),
        },
        Case {
            name: "flat",
            clauses: &["I-062"],
            comment: "Bounds without extent along one axis, and along all.",
            table: fine(Table::raw(1)),
            aabb: [-1.0, 0.25, 2.0, 1.0, 0.25, 4.0],
            instances: vec![("plane", true, [[16000, 4000, 9000, -4000], NONE])],
            asked: vec![
                ("plane", [0, 16384, 3 * 65536], ONE),
                ("plane", [32768, 16384, 2 * 65536], ONE),
                ("plane", [-65536, 99_999, 4 * 65536], ONE),
            ],
        },
        Case {
            name: "point",
            clauses: &["I-062"],
            comment: "Bounds that are a point: the linear coefficients have no effect.",
            table: fine(Table::packed(1)),
            aabb: [5.0, 5.0, 5.0, 5.0, 5.0, 5.0],
            instances: vec![("point", true, [[16000, 4000, 9000, -4000], NONE])],
            asked: vec![
                ("point", [5 * 65536; 3], ONE),
                ("point", [0, 1 << 20, -77], 50_000),
            ],
        },
        Case {
            name: "below-0",
            clauses: &["I-063"],
            comment: "A linear entry that is below 0 over half of its bounds.",
            table: fine(Table::raw(1)),
            aabb: USUAL,
            instances: vec![("e", true, [[0, 30000, 0, 0], NONE])],
            asked: [-60_000, 0, 65_536, 100_000, 190_000]
                .map(|x| ("e", [x, 0, 3 * 65536], ONE))
                .to_vec(),
        },
    ]
}
