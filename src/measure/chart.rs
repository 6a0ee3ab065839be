//! Charts: accuracy against Mbit/s or milliseconds, every method a curve over its quality parameter. As
//! SVG and as CSV.

use std::fmt::Write;

use serde::Serialize;

use super::table::{Table, Value, escape};

mod scale;
use scale::Scale;

/// A chart of lines with markers.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Chart {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub series: Vec<Series>,
    /// Levels that have no place on the x axis, such as a method that sends nothing.
    pub levels: Vec<Level>,
}

/// One axis. Its range follows from the data.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Axis {
    /// With its unit: `rate (Mbit/s)`.
    pub label: String,
    /// Logarithmic; values of 0 and below are then left out.
    pub log: bool,
}

/// One method over its quality parameter.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Series {
    pub name: String,
    /// In the order in which the line visits them.
    pub points: Vec<Point>,
    /// Whether a line joins the points.
    pub line: bool,
}

/// Adds a point to the series of a name, which starts with it, joined by a line, where there is none.
pub fn add_point(series: &mut Vec<Series>, name: &str, point: Point) {
    match series.iter_mut().find(|s| s.name == name) {
        Some(s) => s.points.push(point),
        None => series.push(Series {
            name: name.to_owned(),
            points: vec![point],
            line: true,
        }),
    }
}

/// One measurement.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Point {
    pub x: f64,
    pub y: f64,
    /// The parameter's value, written beside the marker; may be empty.
    pub label: String,
}

/// A dashed horizontal line.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Level {
    pub name: String,
    pub y: f64,
}

/// Okabe and Ito's palette, which colour-blind readers can tell apart; its yellow, too pale for a
/// line on white, is left out.
const PALETTE: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#1a1a1a",
];

const WIDTH: f64 = 640.0;
/// Height without the legend's names.
const HEIGHT: f64 = 406.0;
const LEFT: f64 = 68.0;
const RIGHT: f64 = 24.0;
const BOTTOM: f64 = 62.0;
/// Mean width of a character over the font size; an estimate for placing text.
const CHARACTER: f64 = 0.56;

impl Chart {
    /// The chart's data: series, x, y, label; levels have no x.
    pub fn to_table(&self) -> Table {
        let mut rows = Vec::new();
        for series in &self.series {
            for p in &series.points {
                rows.push(vec![
                    Value::Text(series.name.clone()),
                    Value::Number(p.x, 3),
                    Value::Number(p.y, 3),
                    Value::Text(p.label.clone()),
                ]);
            }
        }
        for level in &self.levels {
            rows.push(vec![
                Value::Text(level.name.clone()),
                Value::Missing,
                Value::Number(level.y, 3),
                Value::Text(String::new()),
            ]);
        }
        let columns = ["series", &self.x.label, &self.y.label, "label"]
            .map(String::from)
            .to_vec();
        Table {
            title: self.title.clone(),
            columns,
            rows,
            note: String::new(),
        }
    }

    /// The chart's data as CSV.
    pub fn to_csv(&self) -> String {
        self.to_table().to_csv()
    }

    /// A self-contained SVG. Points that are not finite, or not positive on a logarithmic axis,
    /// have no place and are left out; the chart says how many.
    pub fn to_svg(&self) -> String {
        let placeable = |p: &Point| self.x.places(p.x) && self.y.places(p.y);
        let points = || self.series.iter().flat_map(|s| &s.points);
        let shown: Vec<&Point> = points().filter(|p| placeable(p)).collect();
        let left_out = points().count() - shown.len();
        let levels: Vec<&Level> = self.levels.iter().filter(|l| self.y.places(l.y)).collect();

        let (legend, legend_height) = self.legend();
        // Names take no place of the plot.
        let (top, height) = (46.0 + legend_height, HEIGHT + legend_height);
        let x = Scale::new(
            shown.iter().map(|p| p.x),
            self.x.log,
            LEFT,
            WIDTH - RIGHT,
            8,
        );
        let y_values = shown.iter().map(|p| p.y).chain(levels.iter().map(|l| l.y));
        let y = Scale::new(y_values, self.y.log, height - BOTTOM, top, 6);

        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" \
             role=\"img\" aria-label=\"{title}\" \
             font-family=\"system-ui, 'Segoe UI', Helvetica, Arial, sans-serif\" \
             font-size=\"12.5\">\n<title>{title}</title>\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>\n\
             <text x=\"{LEFT}\" y=\"26\" font-size=\"16\" font-weight=\"600\" \
             fill=\"#1b1f24\">{title}</text>\n",
            title = escape(&self.title),
        );
        svg += &legend;
        self.axes(&mut svg, &x, &y, top, height);

        let mut labels = Labels {
            taken: Vec::new(),
            lines: Vec::new(),
            top,
            height,
        };
        for level in &levels {
            let at = y.place(level.y);
            labels.lines.push([(LEFT, at), (WIDTH - RIGHT, at)]);
            let _ = writeln!(
                svg,
                "<line x1=\"{LEFT}\" x2=\"{}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#57606a\" \
                 stroke-width=\"1.3\" stroke-dasharray=\"6 4\"/>",
                WIDTH - RIGHT
            );
            let name = escape(&level.name);
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#57606a\">{name}</text>",
                WIDTH - RIGHT - 4.0,
                at - 5.0
            );
            let length = width_of(&level.name, 12.5);
            labels.take(WIDTH - RIGHT - 4.0 - length, at - 17.0, length, 17.0);
        }
        let places: Vec<Vec<(f64, f64)>> = self
            .series
            .iter()
            .map(|s| {
                let kept = s.points.iter().filter(|p| placeable(p));
                kept.map(|p| (x.place(p.x), y.place(p.y))).collect()
            })
            .collect();
        for &(x, y) in places.iter().flatten() {
            labels.take(x - 5.0, y - 5.0, 10.0, 10.0);
        }
        for (i, (series, places)) in self.series.iter().zip(&places).enumerate() {
            let colour = PALETTE[i % PALETTE.len()];
            if series.line && places.len() > 1 {
                labels.lines.extend(places.windows(2).map(|w| [w[0], w[1]]));
                let path: Vec<String> = places
                    .iter()
                    .map(|(x, y)| format!("{x:.1},{y:.1}"))
                    .collect();
                let _ = writeln!(
                    svg,
                    "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" \
                     stroke-width=\"2\" stroke-linejoin=\"round\"/>",
                    path.join(" ")
                );
            }
            for &(x, y) in places {
                marker(&mut svg, i, x, y);
            }
        }
        for (series, places) in self.series.iter().zip(&places) {
            let kept = series.points.iter().filter(|p| placeable(p));
            for (point, &(x, y)) in kept.zip(places) {
                labels.write(&mut svg, &point.label, x, y);
            }
        }
        if shown.is_empty() {
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" fill=\"#57606a\">no data</text>",
                (LEFT + WIDTH - RIGHT) / 2.0,
                (top + height - BOTTOM) / 2.0
            );
        }
        if left_out > 0 {
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"{}\" text-anchor=\"end\" font-size=\"11\" \
                 fill=\"#57606a\">{left_out} without a place on these axes</text>",
                WIDTH - RIGHT,
                height - 8.0
            );
        }
        svg + "</svg>\n"
    }

    /// Names with their markers, in rows below the title; and the rows' height.
    fn legend(&self) -> (String, f64) {
        let mut svg = String::new();
        let (mut x, mut y) = (LEFT, 48.0);
        for (i, series) in self.series.iter().enumerate() {
            let length = 24.0 + width_of(&series.name, 12.5) + 18.0;
            if x > LEFT && x + length > WIDTH - RIGHT {
                x = LEFT;
                y += 20.0;
            }
            if series.line {
                let colour = PALETTE[i % PALETTE.len()];
                let _ = writeln!(
                    svg,
                    "<line x1=\"{x:.1}\" x2=\"{:.1}\" y1=\"{y}\" y2=\"{y}\" stroke=\"{colour}\" \
                     stroke-width=\"2\"/>",
                    x + 18.0
                );
            }
            marker(&mut svg, i, x + 9.0, y);
            let _ = writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{}\" fill=\"#1b1f24\">{}</text>",
                x + 24.0,
                y + 4.4,
                escape(&series.name)
            );
            x += length;
        }
        (
            svg,
            if self.series.is_empty() {
                0.0
            } else {
                y - 48.0 + 24.0
            },
        )
    }

    /// Grid, ticks and labels.
    fn axes(&self, svg: &mut String, x: &Scale, y: &Scale, top: f64, height: f64) {
        let (bottom, right) = (height - BOTTOM, WIDTH - RIGHT);
        for (value, text) in y.ticks() {
            let at = y.place(value);
            let _ = writeln!(
                svg,
                "<line x1=\"{LEFT}\" x2=\"{right}\" y1=\"{at:.1}\" y2=\"{at:.1}\" \
                 stroke=\"#e4e7eb\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\" \
                 fill=\"#424a53\">{text}</text>",
                LEFT - 8.0,
                at + 4.4
            );
        }
        for (value, text) in x.ticks() {
            let at = x.place(value);
            let _ = writeln!(
                svg,
                "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{top}\" y2=\"{bottom}\" \
                 stroke=\"#eef0f2\"/><line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{bottom}\" \
                 y2=\"{}\" stroke=\"#8c959f\"/><text x=\"{at:.1}\" y=\"{}\" \
                 text-anchor=\"middle\" fill=\"#424a53\">{text}</text>",
                bottom + 5.0,
                bottom + 20.0
            );
        }
        let (middle_x, middle_y) = ((LEFT + right) / 2.0, (top + bottom) / 2.0);
        let _ = writeln!(
            svg,
            "<line x1=\"{LEFT}\" x2=\"{right}\" y1=\"{bottom}\" y2=\"{bottom}\" \
             stroke=\"#8c959f\"/>\n<text x=\"{middle_x}\" y=\"{}\" text-anchor=\"middle\" \
             fill=\"#1b1f24\">{}</text>\n<text transform=\"translate(20 {middle_y}) rotate(-90)\" \
             text-anchor=\"middle\" fill=\"#1b1f24\">{}</text>",
            bottom + 44.0,
            escape(&self.x.label),
            escape(&self.y.label)
        );
    }
}

impl Axis {
    fn places(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value > 0.0)
    }
}

/// A marker whose shape, too, tells the series: colour alone does not survive a printer.
fn marker(svg: &mut String, series: usize, x: f64, y: f64) {
    let style = format!(
        "fill=\"{}\" stroke=\"#fff\" stroke-width=\"1.2\"",
        PALETTE[series % PALETTE.len()]
    );
    let _ = match series % 4 {
        0 => writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" {style}/>"),
        1 => writeln!(
            svg,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"9\" height=\"9\" {style}/>",
            x - 4.5,
            y - 4.5
        ),
        2 => writeln!(
            svg,
            "<path d=\"M{x:.1} {:.1}l5.4 9.6h-10.8z\" {style}/>",
            y - 5.8
        ),
        _ => writeln!(
            svg,
            "<path d=\"M{x:.1} {:.1}l5.8 5.8l-5.8 5.8l-5.8-5.8z\" {style}/>",
            y - 5.8
        ),
    };
}

/// Places the points' labels so that they cover neither markers nor each other, and no line where
/// that can be had.
struct Labels {
    /// x, y, width, height of what is drawn already.
    taken: Vec<[f64; 4]>,
    /// Segments of the curves.
    lines: Vec<[(f64, f64); 2]>,
    top: f64,
    /// Of the whole chart.
    height: f64,
}

impl Labels {
    fn take(&mut self, x: f64, y: f64, width: f64, height: f64) {
        self.taken.push([x, y, width, height]);
    }

    /// Writes `text` at the first free side of a marker; drops it where there is none.
    fn write(&mut self, svg: &mut String, text: &str, x: f64, y: f64) {
        const SIZE: f64 = 11.0;
        let (width, height) = (width_of(text, SIZE), SIZE + 2.0);
        if text.is_empty() {
            return;
        }
        let sides = [
            (x - width / 2.0, y - 9.0 - height),
            (x - width / 2.0, y + 9.0),
            (x + 9.0, y - height / 2.0),
            (x - 9.0 - width, y - height / 2.0),
            (x + 6.0, y - 6.0 - height),
            (x + 6.0, y + 6.0),
            (x - 6.0 - width, y - 6.0 - height),
            (x - 6.0 - width, y + 6.0),
        ];
        let free = |&(left, top): &(f64, f64)| {
            left >= LEFT
                && left + width <= WIDTH
                && top >= self.top - 16.0
                && top + height <= self.height - BOTTOM
                && !self.taken.iter().any(|[x, y, w, h]| {
                    left < x + w && *x < left + width && top < y + h && *y < top + height
                })
        };
        let clear = |&(left, top): &(f64, f64)| {
            let (centre_x, centre_y) = (left + width / 2.0, top + height / 2.0);
            let inside = |(x, y): (f64, f64)| {
                (x - centre_x).abs() < width / 2.0 && (y - centre_y).abs() < height / 2.0
            };
            // Steps of a hundredth of a segment are shorter than any label.
            let between = |a: f64, b: f64, i: i32| a + (b - a) * f64::from(i) / 100.0;
            let crossed = self.lines.iter().any(|[a, b]| {
                (0..=100).any(|i| inside((between(a.0, b.0, i), between(a.1, b.1, i))))
            });
            !crossed
        };
        let best = sides.into_iter().find(|side| free(side) && clear(side));
        if let Some((left, top)) = best.or_else(|| sides.into_iter().find(free)) {
            let _ = writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"{SIZE}\" \
                 fill=\"#424a53\" stroke=\"#fff\" stroke-width=\"2.5\" \
                 paint-order=\"stroke\">{}</text>",
                left + width / 2.0,
                top + SIZE - 1.0,
                escape(text)
            );
            self.take(left, top, width, height);
        }
    }
}

fn width_of(text: &str, size: f64) -> f64 {
    text.chars().count() as f64 * CHARACTER * size
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart() -> Chart {
        let point = |x, y, label: &str| Point {
            x,
            y,
            label: label.to_string(),
        };
        Chart {
            title: "Accuracy & rate".to_string(),
            x: Axis {
                label: "rate (Mbit/s)".to_string(),
                log: true,
            },
            y: Axis {
                label: "PSNR <dB>".to_string(),
                log: false,
            },
            series: vec![
                Series {
                    name: "points".to_string(),
                    points: vec![point(1.0, 20.0, "64"), point(10.0, 30.0, "512")],
                    line: true,
                },
                Series {
                    name: "other".to_string(),
                    points: vec![point(0.0, 25.0, "hidden"), point(3.0, f64::INFINITY, "")],
                    line: true,
                },
            ],
            levels: vec![Level {
                name: "SSAO".to_string(),
                y: 22.0,
            }],
        }
    }

    #[test]
    fn points_without_a_place_are_counted() {
        let svg = chart().to_svg();
        assert!(svg.contains("2 without a place"), "{svg}");
        assert!(!svg.contains("hidden") && !svg.contains("NaN") && !svg.contains("inf"));
        assert!(svg.contains("Accuracy &amp; rate") && svg.contains("PSNR &lt;dB&gt;"));
        assert_eq!(svg.matches("<polyline").count(), 1);
    }

    /// Many long names make the chart higher and leave the plot as it is.
    #[test]
    fn names_take_no_place_of_the_plot() {
        // Height of the chart, and top and bottom of the grid.
        let numbers = |names: usize| -> [f64; 3] {
            let series = (0..names).map(|i| Series {
                name: format!("a method with a name as long as the width of the chart, {i}"),
                points: vec![Point {
                    x: 1.0,
                    y: 2.0,
                    label: String::new(),
                }],
                line: false,
            });
            let series = series.collect();
            let svg = Chart {
                series,
                ..Chart::default()
            }
            .to_svg();
            let after = |text: &str, svg: &str| -> f64 {
                let at = svg.find(text).expect(text) + text.len();
                let number = svg[at..].split('"').next().expect("a number");
                number.parse().expect("a number")
            };
            let ticks = &svg[svg.find("#eef0f2").expect("a grid") - 60..];
            [
                after("viewBox=\"0 0 640 ", &svg),
                after("y1=\"", ticks),
                after("y2=\"", ticks),
            ]
        };
        let [one, many] = [1, 9].map(numbers);
        assert_eq!(many[0] - one[0], 8.0 * 20.0);
        assert_eq!(many[2] - many[1], one[2] - one[1]);
    }

    #[test]
    fn csv_has_every_point_and_level() {
        let csv = chart().to_csv();
        assert_eq!(csv.lines().count(), 6, "{csv}");
        assert!(csv.starts_with("series,rate (Mbit/s),PSNR <dB>,label\npoints,1,20,64\n"));
        assert!(csv.contains("other,3,inf,\n") && csv.ends_with("SSAO,,22,\n"));
    }

    #[test]
    fn nothing_to_show_is_still_a_picture() {
        for points in [
            vec![],
            vec![Point {
                x: 2.0,
                y: 2.0,
                ..Point::default()
            }],
        ] {
            let series = vec![Series {
                points,
                line: true,
                ..Series::default()
            }];
            let svg = Chart {
                series,
                ..Chart::default()
            }
            .to_svg();
            assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN"));
        }
        assert!(Chart::default().to_svg().contains("no data"));
    }
}
