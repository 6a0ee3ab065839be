use super::super::chart::{Axis, Level, Point, Series};
use super::super::table::Value;
use super::*;

#[test]
fn nothing_reaches_the_page_unescaped() {
    let evil = "<script>\"'&";
    let text = || evil.to_string();
    let chart = Chart {
        title: text(),
        x: Axis {
            label: text(),
            log: false,
        },
        y: Axis {
            label: text(),
            log: false,
        },
        series: vec![Series {
            name: text(),
            points: vec![Point {
                x: 1.0,
                y: 1.0,
                label: text(),
            }],
            line: true,
        }],
        levels: vec![Level {
            name: text(),
            y: 1.0,
        }],
    };
    let table = Table {
        title: text(),
        columns: vec![text()],
        rows: vec![vec![Value::Text(text())]],
        note: text(),
    };
    let section = Section {
        title: text(),
        text: text(),
        images: vec![Image {
            caption: text(),
            detail: text(),
            source: Source::File(text()),
        }],
        charts: vec![chart],
        tables: vec![table],
    };
    let figure = Figure {
        label: text(),
        value: text(),
        unit: text(),
        note: text(),
    };
    let report = Report {
        title: text(),
        subtitle: text(),
        figures: vec![figure],
        sections: vec![section],
        notes: vec![text()],
    };
    let html = report.to_html().expect("page");
    assert!(!html.contains("<script"));
    assert!(html.contains("./%3Cscript%3E%22%27%26"));
    assert!(html.matches("&lt;script&gt;&quot;&#39;&amp;").count() >= 20);
}

#[test]
fn files_are_written_and_json_has_no_infinity() {
    #[derive(Serialize)]
    struct Data {
        psnr: f64,
    }
    let folder = tempfile::tempdir().expect("folder");
    let data = Data {
        psnr: f64::INFINITY,
    };
    write(&Report::default(), &data, folder.path()).expect("written");
    let json = std::fs::read_to_string(folder.path().join("report.json")).expect("read");
    assert_eq!(json, "{\n  \"psnr\": null\n}\n");
    let below_a_file = folder.path().join("report.json/folder");
    assert!(write(&Report::default(), &data, &below_a_file).is_err());
}

/// A page of every kind of content. `DAPPLE_KEEP_REPORT=DIR` keeps it to be looked at.
#[test]
fn a_full_page_is_well_formed() {
    let picture = |phase: f32| {
        let values: Vec<f32> = (0..480 * 270)
            .map(|i| {
                let (x, y) = ((i % 480) as f32 / 60.0, (i / 480) as f32 / 60.0);
                0.6 + 0.3 * (x + phase).sin() * (y * 1.3).cos()
            })
            .collect();
        Picture::from_values(480, 270, &values)
    };
    let (method, reference) = (picture(0.05), picture(0.0));
    let flip = super::super::flip::error_picture(&method, &reference).expect("FLIP");
    let image = |caption: &str, detail: &str, picture: &Picture| Image {
        caption: caption.to_string(),
        detail: detail.to_string(),
        source: Source::Embedded(picture.clone()),
    };
    let curve = |name: &str, base: f64, rate: f64| Series {
        name: name.to_string(),
        line: true,
        points: [64, 256, 512, 1024]
            .iter()
            .map(|&n| Point {
                x: rate * f64::from(n) / 64.0,
                y: base + 2.4 * f64::from(n / 64).log2(),
                label: format!("{n}"),
            })
            .collect(),
    };
    let chart = |title: &str, x: &str, log| Chart {
        title: title.to_string(),
        x: Axis {
            label: x.to_string(),
            log,
        },
        y: Axis {
            label: "PSNR against ray-traced reference (dB)".to_string(),
            log: false,
        },
        series: vec![
            curve("points, 32 bits", 24.0, 1.1),
            curve("points, 24 bits", 23.8, 0.8),
            curve("points, 16 bits", 22.9, 0.55),
            curve("texture space", 21.0, 2.2),
        ],
        levels: vec![Level {
            name: "screen space: no stream".to_string(),
            y: 26.3,
        }],
    };
    let figure = |label: &str, value: &str, unit: &str, note: &str| Figure {
        label: label.to_string(),
        value: value.to_string(),
        unit: unit.to_string(),
        note: note.to_string(),
    };
    let row = |n: u64| {
        vec![
            Value::Text("sponza_boulders".to_string()),
            Value::Text("camera_a".to_string()),
            Value::Count(n),
            Value::Count(n * 4_071),
            Value::Number(n as f64 * 0.0137, 2),
            Value::Number(24.0 + (n as f64 / 64.0).log2() * 2.4, 2),
            Value::Number(0.08 / (n as f64 / 64.0).log2().max(0.8), 4),
            Value::Missing,
        ]
    };
    let columns = [
        "scene",
        "camera",
        "N",
        "points",
        "Mbit/s",
        "PSNR (dB)",
        "FLIP",
        "SSIM",
    ];
    let report = Report {
        title: "Streamed ambient occlusion against ray tracing".to_string(),
        subtitle: "hall, camera 1, 480 x 270, 60 frames at 60 Hz, N = 1024, seed 0".to_string(),
        figures: vec![
            figure("Steady rate", "14.0", "Mbit/s", "without keyframes, 60 Hz"),
            figure("Start-up", "3.21", "MB", "first frame, zstd 15"),
            figure("PSNR", "32.6", "dB", "composited picture, mean of 8 frames"),
            figure("FLIP", "0.046", "", "67 pixels a degree"),
            figure("Points", "412 337", "", "206 169 after thinning"),
            figure("Tick", "11.8", "ms", "2 cores, 128 rays a point"),
        ],
        sections: vec![
            Section {
                title: "Pictures".to_string(),
                text: "Both pictures are composited over the same supersampled shading, so that \
                       they differ by ambient occlusion alone."
                    .to_string(),
                images: vec![
                    image("Decoded stream", "PSNR 32.6 dB, FLIP 0.046", &method),
                    image("Reference", "512 rays a pixel, noise 0.004 rms", &reference),
                    image("FLIP error", "black 0, white 1", &flip),
                ],
                ..Section::default()
            },
            Section {
                title: "Accuracy".to_string(),
                charts: vec![
                    chart("Accuracy against rate", "steady rate (Mbit/s)", true),
                    chart("Accuracy against time", "client time a frame (ms)", false),
                ],
                tables: vec![Table {
                    title: "Quality over point density".to_string(),
                    columns: columns.map(String::from).to_vec(),
                    rows: [64, 256, 512, 1024].map(row).to_vec(),
                    note: "Rates are over all 900 frames with visibility on.".to_string(),
                }],
                ..Section::default()
            },
        ],
        notes: vec![
            "Timings were taken on a software adapter and say nothing about GPUs.".to_string(),
            "dapple demo --out demo".to_string(),
        ],
    };
    let html = report.to_html().expect("page");
    for tag in [
        "figure", "section", "table", "tr", "td", "svg", "div", "dl", "p", "text",
    ] {
        let opened =
            html.matches(&format!("<{tag}>")).count() + html.matches(&format!("<{tag} ")).count();
        assert_eq!(opened, html.matches(&format!("</{tag}>")).count(), "{tag}");
        assert!(opened > 0, "{tag}");
    }
    assert_eq!(html.matches("data:image/png;base64,").count(), 3);
    if let Some(folder) = std::env::var_os("DAPPLE_KEEP_REPORT") {
        write(&report, &0, Path::new(&folder)).expect("kept");
    }
}
