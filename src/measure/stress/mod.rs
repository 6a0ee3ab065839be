//! Stress scenes for light from probes and for baked obscurance. Each is swept over one parameter, from values that work to
//! values that do not, and has figures, bounds where one can be promised, a sentence on what happens
//! beyond them, and pictures.
//!
//! - [`scene_builder`] builds the scenes, [`places`] has sample positions and the reference there, [`panels`] the
//!   pictures, [`fixture`] the server, stream and client that the cases share.
//! - [`leaks`]: through walls, and from probes inside them; [`house`]: through those of a whole house
//! - [`ringing`]: of an expansion about a small hot emitter
//! - [`time`]: lag after a change, flicker without one
//! - [`range`]: light too bright for the format, places outside of the volume
//! - [`baked`]: the solvers of the baked models, where samples are missing, uneven or flat, and where regions meet

pub mod baked;
pub mod fixture;
pub mod house;
pub mod leaks;
pub mod panels;
pub mod places;
pub mod range;
pub mod ringing;
pub mod scene_builder;
pub mod time;

use super::table::{Table, Value};
use crate::Result;
use crate::render::Picture;
use serde::Serialize;

/// How much is computed: [`Effort::Quick`] runs a few values of each parameter with few rays, for tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    Quick,
    Full,
}

impl Effort {
    /// One of two values.
    pub fn of<T>(self, quick: T, full: T) -> T {
        match self {
            Effort::Quick => quick,
            Effort::Full => full,
        }
    }

    /// Settings of a parameter: all, or the marked ones.
    fn settings<T: Copy>(self, all: &[(T, bool)]) -> Vec<T> {
        let taken = all.iter().filter(|(_, q)| *q || self == Effort::Full);
        taken.map(|(setting, _)| *setting).collect()
    }
}

/// A scene swept over one parameter.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub name: &'static str,
    /// What the scene is and what is measured.
    pub about: &'static str,
    /// The parameter and its unit.
    pub parameter: &'static str,
    /// What happens beyond the bounds.
    pub beyond: &'static str,
    pub run: fn(Effort) -> Result<Finding>,
}

/// All of them, in the order of the table.
pub const CASES: [Case; 12] = [
    leaks::SEALED_ROOM,
    house::SEALED_HOUSE,
    ringing::RINGING,
    time::LAG,
    time::FLICKER,
    leaks::PROBES_IN_WALLS,
    range::BRIGHT_SUN,
    range::OUTSIDE,
    baked::vertices::INSIDE_GEOMETRY,
    baked::vertices::HUGE,
    baked::instances::FLAT,
    baked::regions::BOUNDARY,
];

/// The measurements of a case.
#[derive(Clone, Debug, Default)]
pub struct Finding {
    pub rows: Vec<Row>,
    /// Pictures by name and what they show.
    pub pictures: Vec<Shot>,
}

#[derive(Clone, Debug)]
pub struct Shot {
    /// Of the file, after the case's name; may be empty.
    pub name: &'static str,
    pub caption: String,
    pub picture: Picture,
}

/// One figure at one value of the parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The value of the parameter.
    pub at: String,
    pub figure: &'static str,
    pub value: f64,
    pub bound: Option<Bound>,
}

/// The bound on a figure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    AtMost(f64),
    AtLeast(f64),
}

impl Bound {
    /// Not a number is out of bounds.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Bound::AtMost(most) => value <= most,
            Bound::AtLeast(least) => value >= least,
        }
    }

    pub fn shown(self) -> String {
        match self {
            Bound::AtMost(most) => format!("<= {}", shown(most)),
            Bound::AtLeast(least) => format!(">= {}", shown(least)),
        }
    }
}

impl Row {
    /// Whether the bound holds; `None` without one.
    pub fn holds(&self) -> Option<bool> {
        self.bound.map(|bound| bound.holds(self.value))
    }
}

impl Finding {
    pub fn add(&mut self, at: &str, figure: &'static str, value: f64) {
        self.rows.push(Row {
            at: at.into(),
            figure,
            value,
            bound: None,
        });
    }

    /// Adds a figure with a bound.
    pub fn bounded(&mut self, at: &str, figure: &'static str, value: f64, bound: Bound) {
        self.rows.push(Row {
            at: at.into(),
            figure,
            value,
            bound: Some(bound),
        });
    }

    /// The value of a figure at a setting.
    pub fn value(&self, at: &str, figure: &str) -> Option<f64> {
        let row = self.rows.iter().find(|r| r.at == at && r.figure == figure);
        row.map(|r| r.value)
    }

    /// Whether all bounds hold.
    pub fn holds(&self) -> bool {
        self.rows.iter().all(|row| row.holds() != Some(false))
    }

    /// A row a setting, a column a figure; a figure that breaks its bound is marked with `!`.
    pub fn table(&self, case: &Case) -> Table {
        let mut settings: Vec<&str> = Vec::new();
        let mut figures: Vec<&str> = Vec::new();
        for row in &self.rows {
            if !settings.contains(&row.at.as_str()) {
                settings.push(&row.at);
            }
            if !figures.contains(&row.figure) {
                figures.push(row.figure);
            }
        }
        let cell = |at: &str, name: &str| {
            let row = self.rows.iter().find(|r| r.at == at && r.figure == name);
            match row {
                None => Value::Missing,
                Some(row) => Value::Text(match row.holds() {
                    Some(false) => format!("{} !", shown(row.value)),
                    _ => shown(row.value),
                }),
            }
        };
        let mut columns = vec![case.parameter.to_string()];
        for name in &figures {
            let mut bounds: Vec<String> = Vec::new();
            for row in self.rows.iter().filter(|r| r.figure == *name) {
                let shown = row.bound.map(Bound::shown);
                bounds.extend(shown.filter(|b| !bounds.contains(b)));
            }
            columns.push(match &bounds[..] {
                [] => name.to_string(),
                [one] => format!("{name} ({one})"),
                _ => format!("{name} (bounded)"),
            });
        }
        let line = |at: &&str| {
            let first = Value::Text(at.to_string());
            let cells = figures.iter().map(|name| cell(at, name));
            std::iter::once(first).chain(cells).collect()
        };
        Table {
            title: case.name.into(),
            columns,
            rows: settings.iter().map(line).collect(),
            note: String::new(),
        }
    }
}

/// All figures of all cases, one a line.
pub fn long_table(found: &[(Case, Finding)]) -> Table {
    let columns = [
        "case",
        "parameter",
        "setting",
        "figure",
        "value",
        "bound",
        "holds",
    ];
    let line = |case: &Case, row: &Row| {
        let text = |text: &str| Value::Text(text.into());
        vec![
            text(case.name),
            text(case.parameter),
            text(&row.at),
            text(row.figure),
            Value::Number(row.value, 6),
            row.bound.map_or(Value::Missing, |b| text(&b.shown())),
            row.holds()
                .map_or(Value::Missing, |h| text(if h { "yes" } else { "no" })),
        ]
    };
    Table {
        title: "Stress scenes".into(),
        columns: columns.map(String::from).to_vec(),
        rows: found
            .iter()
            .flat_map(|(case, finding)| finding.rows.iter().map(move |row| line(case, row)))
            .collect(),
        note: String::new(),
    }
}

/// A number with three significant digits; two, and a power of ten, where it is small.
fn shown(value: f64) -> String {
    let digits = value.abs().log10().floor();
    if (-9.0..-4.0).contains(&digits) {
        return format!("{value:.1e}");
    }
    let decimals = if digits.is_finite() {
        2.0 - digits
    } else {
        0.0
    };
    Value::Number(value, decimals.clamp(0.0, 6.0) as usize).shown()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_hold_or_not() {
        assert!(Bound::AtMost(1.0).holds(1.0) && !Bound::AtMost(1.0).holds(1.1));
        assert!(Bound::AtLeast(1.0).holds(1.0) && !Bound::AtLeast(1.0).holds(0.9));
        assert!(!Bound::AtMost(1.0).holds(f64::NAN) && !Bound::AtLeast(1.0).holds(f64::NAN));
    }

    #[test]
    fn the_table_has_a_row_a_setting_and_marks_what_breaks() {
        let mut finding = Finding::default();
        finding.add("a", "x", 1.0);
        finding.bounded("a", "y", 0.5, Bound::AtMost(0.1));
        finding.bounded("b", "y", 0.05, Bound::AtMost(0.1));
        let table = finding.table(&CASES[0]);
        assert_eq!(table.columns[1..], ["x", "y (<= 0.100)"]);
        let shown: Vec<Vec<String>> = table
            .rows
            .iter()
            .map(|r| r.iter().map(Value::shown).collect())
            .collect();
        assert_eq!(
            shown,
            [["a", "1.00", "0.500 !"], ["b", "\u{2013}", "0.0500"]]
        );
        assert!(!finding.holds());
        let long = long_table(&[(CASES[0], finding)]);
        assert_eq!(long.rows.len(), 3);
        assert!(long.to_csv().contains(",y,0.5,<= 0.100,no\n"));
    }

    #[test]
    fn figures_are_short() {
        let all = [
            0.0,
            1.0,
            12.345,
            1234.5,
            0.012345,
            -0.00012345,
            1.234e-6,
            1e-12,
            f64::NAN,
        ];
        let expected = [
            "0",
            "1.00",
            "12.3",
            "1234",
            "0.0123",
            "-0.000123",
            "1.2e-6",
            "0.000000",
            "n/a",
        ];
        assert_eq!(all.map(shown), expected);
    }

    #[test]
    fn names_are_unique_and_plain() {
        for (i, case) in CASES.iter().enumerate() {
            assert!(
                case.name
                    .chars()
                    .all(|c| c.is_ascii_lowercase() || c == '-')
            );
            assert!(CASES[..i].iter().all(|other| other.name != case.name));
            assert!(case.beyond.ends_with('.') && case.about.ends_with('.'));
        }
    }
}
