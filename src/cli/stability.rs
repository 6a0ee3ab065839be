//! `dapple stability`: stress scenes, each swept over one parameter, and their bounds.

use super::output;
use super::progress::Progress;
use crate::measure::report::{Figure, Image, Report, Section, Source, save, write};
use crate::measure::stress::{CASES, Case, Effort, Finding, Row, long_table};
use crate::measure::table::{Table, Value};
use crate::{Result, files};
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;

/// Measure how light from probes and baked obscurance fail: named scenes, each swept over one parameter until
/// it breaks, with figures, bounds and pictures.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder for table.md, table.csv, pictures and index.html; it is made if it is missing.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// One case alone; may be given again.
    #[arg(long = "case", value_name = "NAME",
        value_parser = clap::builder::PossibleValuesParser::new(CASES.map(|case| case.name)))]
    cases: Vec<String>,
    /// A few settings with few rays: a taste, not a measurement.
    #[arg(long)]
    quick: bool,
    /// Print one JSON document.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Document {
    case: &'static str,
    about: &'static str,
    parameter: &'static str,
    rows: Vec<CheckedRow>,
    beyond: &'static str,
    /// Whether all bounds hold.
    holds: bool,
}

#[derive(Serialize)]
struct CheckedRow {
    #[serde(flatten)]
    row: Row,
    holds: Option<bool>,
}

/// Runs the command. A bound that breaks is a result, not an error.
///
/// # Errors
/// `Io` where the folder cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    if let Some(folder) = &args.output {
        files::create_folder(folder)?;
    }
    let effort = if args.quick {
        Effort::Quick
    } else {
        Effort::Full
    };
    let asked = |case: &Case| args.cases.is_empty() || args.cases.iter().any(|n| n == case.name);
    let cases: Vec<Case> = CASES.into_iter().filter(asked).collect();
    let bar = Progress::new("Stress scenes", cases.len() as u64);
    let mut found = Vec::new();
    for case in cases {
        found.push((case, (case.run)(effort)?));
        bar.step(1);
    }
    drop(bar);

    let documents: Vec<Document> = found.iter().map(document).collect();
    if let Some(folder) = &args.output {
        for (case, finding) in &found {
            for shot in &finding.pictures {
                shot.picture
                    .write_png(&folder.join(file(case, shot.name)))?;
            }
        }
        save(&folder.join("table.csv"), &long_table(&found).to_csv())?;
        save(&folder.join("table.md"), &markdown(&found))?;
        write(&page(&found, effort), &documents, folder)?;
    }
    if args.json {
        output::print_json(&documents)?;
    } else {
        output::print(&markdown(&found))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn document((case, finding): &(Case, Finding)) -> Document {
    let checked = |row: &Row| CheckedRow {
        row: row.clone(),
        holds: row.holds(),
    };
    Document {
        case: case.name,
        about: case.about,
        parameter: case.parameter,
        rows: finding.rows.iter().map(checked).collect(),
        beyond: case.beyond,
        holds: finding.holds(),
    }
}

fn file(case: &Case, name: &str) -> String {
    match name {
        "" => format!("{}.png", case.name),
        name => format!("{}-{name}.png", case.name),
    }
}

fn markdown(found: &[(Case, Finding)]) -> String {
    let mut text = String::new();
    for (case, finding) in found {
        text += &format!("### {}\n\n{}\n\n", case.name, case.about);
        text += &rows(&finding.table(case));
        text += &format!("\nBeyond: {}\n\n", case.beyond);
    }
    text
}

fn rows(table: &Table) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let mut text = line(&table.columns);
    text += &format!("|{}\n", " --- |".repeat(table.columns.len()));
    for row in &table.rows {
        text += &line(&row.iter().map(Value::shown).collect::<Vec<_>>());
    }
    text
}

fn page(found: &[(Case, Finding)], effort: Effort) -> Report {
    let section = |(case, finding): &(Case, Finding)| Section {
        title: case.name.into(),
        text: format!("{} Beyond: {}", case.about, case.beyond),
        images: finding
            .pictures
            .iter()
            .map(|shot| Image {
                caption: shot.caption.clone(),
                detail: String::new(),
                source: Source::File(file(case, shot.name)),
            })
            .collect(),
        tables: vec![Table {
            title: String::new(),
            ..finding.table(case)
        }],
        ..Section::default()
    };
    let bounds = || {
        found
            .iter()
            .flat_map(|(_, f)| &f.rows)
            .filter_map(Row::holds)
    };
    let (all, kept) = (bounds().count(), bounds().filter(|h| *h).count());
    Report {
        title: "Stress scenes".into(),
        subtitle: effort.of("A taste: few settings, few rays.", "").into(),
        figures: vec![Figure {
            label: "bounds that hold".into(),
            value: format!("{kept} of {all}"),
            ..Figure::default()
        }],
        sections: found.iter().map(section).collect(),
        notes: vec!["A figure with ! is beyond its bound.".into()],
    }
}
