//! The report of `dapple inspect` as text.

use super::{ModelReport, Report, TrackReport, ratio};
use crate::cli::output;
use crate::cli::records::RecordTotal;
use crate::codec::container::{HEADER_BYTES, PREAMBLE_BYTES};

/// Tracks that the text report lists; `--json` lists all.
const LISTED_TRACKS: usize = 20;

impl Report {
    /// All of the report.
    pub fn to_text(&self) -> String {
        let mut text = self.first_line();
        if self.container_version.is_none() {
            return text;
        }
        for part in [
            self.record_table(),
            self.frame_table(),
            self.frames.to_text(),
            self.track_table(),
        ] {
            if !part.is_empty() {
                text.push('\n');
                text += &part;
            }
        }
        text
    }

    fn first_line(&self) -> String {
        let mut text = format!("{}, {} bytes", self.file, self.bytes);
        if let Some(version) = self.container_version {
            text += &format!(", container version {version}");
        }
        if let Some([ticks, seconds]) = self.tick_rate {
            let hz = f64::from(ticks) / f64::from(seconds);
            let rounded = format!("{hz:.6}");
            text += ", ";
            text += rounded.trim_end_matches('0').trim_end_matches('.');
            text += " ticks a second";
        }
        text += match (&self.fault, self.ended) {
            (Some(fault), _) => match fault.kind {
                "Unsupported" => ", made for a newer program",
                "LimitExceeded" => ", beyond a limit",
                "Truncated" => ", cut off",
                _ => ", damaged",
            },
            (None, true) => "",
            (None, false) => ", no end record (live)",
        };
        text.push('\n');
        text
    }

    /// Payload bytes by type of record.
    fn record_table(&self) -> String {
        let mut total = RecordTotal::default();
        for report in &self.records {
            total = total.plus(&report.total);
        }
        let framing = total.records * HEADER_BYTES as u64 + PREAMBLE_BYTES as u64;
        let all = framing + total.stored_bytes;
        let row = |name: &str, t: &RecordTotal| {
            vec![
                name.to_string(),
                t.records.to_string(),
                t.stored_bytes.to_string(),
                share(t.stored_bytes, all),
                t.unpacked_bytes.to_string(),
                ratio(t).map_or(String::new(), |r| format!("{r:.2}")),
            ]
        };
        let names = ["records", "count", "stored", "share", "unpacked", "ratio"];
        let mut rows = vec![names.map(String::from).to_vec()];
        for report in &self.records {
            let name = match report.name {
                "unknown" => format!("type {}", report.number),
                name => name.to_string(),
            };
            rows.push(row(&name, &report.total));
        }
        rows.push(row("all payloads", &total));
        rows.push(vec![
            "headers".to_string(),
            String::new(),
            framing.to_string(),
            share(framing, all),
        ]);
        output::columns(&rows)
    }

    /// Bytes by kind of frame, headers included.
    fn frame_table(&self) -> String {
        let frames = &self.frames;
        let (keyframes, plain) = frames.later();
        let kinds = [
            ("start-up", frames.frames.min(1), frames.bytes_startup),
            ("later keyframes", keyframes, frames.bytes_keyframes),
            ("other frames", plain, frames.bytes_steady),
            ("after the last", 0, self.bytes_after),
        ];
        let all = kinds.iter().map(|(_, _, bytes)| bytes).sum();
        let row = |name: &str, count: u64, bytes: u64| {
            vec![
                name.to_string(),
                count.to_string(),
                bytes.to_string(),
                share(bytes, all),
                bytes
                    .checked_div(count)
                    .map_or(String::new(), |mean| mean.to_string()),
            ]
        };
        let names = ["frames", "count", "bytes", "share", "mean"];
        let mut rows = vec![names.map(String::from).to_vec()];
        rows.extend(kinds.map(|(name, count, bytes)| row(name, count, bytes)));
        let mut text = output::columns(&rows);
        text += &format!(
            "{}, {} of them keyframes",
            output::counted(frames.frames, "frame"),
            frames.keyframes
        );
        let mut rates = Vec::new();
        if let Some(rate) = self.mbps_steady {
            rates.push(format!("{rate:.3} Mbit/s without keyframes"));
        }
        if let Some(rate) = self.mbps_with_keyframes {
            rates.push(format!("{rate:.3} Mbit/s with them"));
        }
        if !rates.is_empty() {
            text += &format!("; after the first frame {}", rates.join(", "));
        }
        text.push('\n');
        text
    }

    fn track_table(&self) -> String {
        let mut text = self.points_table() + &self.probes_table() + &self.baked_table();
        let points = |t: &&TrackReport| matches!(t.model, ModelReport::Points { .. });
        let points = self.tracks.iter().filter(points).count();
        let more = [points, self.tracks.len() - points]
            .map(|count| count.saturating_sub(LISTED_TRACKS))
            .iter()
            .sum::<usize>();
        if more > 0 {
            text += &format!("{more} tracks more: --json lists them all\n");
        }
        if self.tracks_removed > 0 {
            text += &format!(
                "{} tracks were declared, {} of them removed again\n",
                self.tracks_declared, self.tracks_removed
            );
        }
        text
    }

    fn points_table(&self) -> String {
        let names = [
            "points track",
            "space",
            "grid",
            "radius (m)",
            "bits",
            "buckets",
            "cells",
            "points",
        ];
        let mut rows = vec![names.map(String::from).to_vec()];
        let mut sums = [0; 3];
        let mut count = 0;
        for t in &self.tracks {
            let ModelReport::Points {
                radius,
                point_bits,
                buckets,
                cells,
                points,
                ..
            } = t.model
            else {
                continue;
            };
            count += 1;
            for (sum, more) in sums.iter_mut().zip([buckets.into(), cells, points]) {
                *sum += more;
            }
            if count <= LISTED_TRACKS {
                rows.push(vec![
                    t.name(),
                    t.space.to_string(),
                    t.grid(),
                    format!("{radius:.4}"),
                    point_bits.to_string(),
                    buckets.to_string(),
                    cells.to_string(),
                    points.to_string(),
                ]);
            }
        }
        let mut last = vec![format!("{count} in all")];
        last.resize(5, String::new());
        last.extend(sums.map(|sum: u64| sum.to_string()));
        rows.push(last);
        match count == 0 && !self.tracks.is_empty() {
            true => String::new(),
            false => output::columns(&rows),
        }
    }

    fn probes_table(&self) -> String {
        let names = [
            "probes track",
            "coding",
            "volume",
            "spacing (m)",
            "visibility",
            "probes",
            "present",
        ];
        let mut rows = vec![names.map(String::from).to_vec()];
        for t in &self.tracks {
            let ModelReport::Probes {
                coding,
                spacing: [x, y, z],
                visibility_side: side,
                has_visibility,
                probes,
                present,
                ..
            } = t.model
            else {
                continue;
            };
            if rows.len() <= LISTED_TRACKS {
                rows.push(vec![
                    t.name(),
                    coding.to_string(),
                    t.grid(),
                    format!("{x:.2}, {y:.2}, {z:.2}"),
                    match has_visibility {
                        true => format!("{side}x{side}"),
                        false => "none".to_string(),
                    },
                    probes.to_string(),
                    present.to_string(),
                ]);
            }
        }
        match rows.len() {
            1 => String::new(),
            _ => output::columns(&rows),
        }
    }

    fn baked_table(&self) -> String {
        let names = ["baked track", "model", "coding", "signals", "items"];
        let mut rows = vec![names.map(String::from).to_vec()];
        for t in &self.tracks {
            let (model, coding, signals, items) = match t.model {
                ModelReport::Points { .. } | ModelReport::Probes { .. } => continue,
                ModelReport::Vertices {
                    coding,
                    signals,
                    vertices,
                    ..
                } => ("vertices", coding, signals, vertices.into()),
                ModelReport::Instances {
                    coding,
                    signals,
                    entries,
                } => ("instances", coding, signals, entries),
                ModelReport::Regions {
                    coding,
                    signals,
                    entries,
                    ..
                } => ("regions", coding, signals, entries),
            };
            if rows.len() <= LISTED_TRACKS {
                rows.push(vec![
                    t.name(),
                    model.to_string(),
                    coding.to_string(),
                    signals.to_string(),
                    items.to_string(),
                ]);
            }
        }
        match rows.len() {
            1 => String::new(),
            _ => output::columns(&rows),
        }
    }
}

impl TrackReport {
    fn name(&self) -> String {
        let path: String = self.path.chars().filter(|c| !c.is_control()).collect();
        format!("{} {path}", self.id)
    }

    fn grid(&self) -> String {
        let [x, y, z] = self.dims.unwrap_or_default();
        format!("{x}x{y}x{z}")
    }
}

/// A part of a whole in per cent.
fn share(part: u64, whole: u64) -> String {
    format!("{:.1} %", 100.0 * part as f64 / whole.max(1) as f64)
}
