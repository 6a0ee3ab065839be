//! Tables of figures, as CSV and as HTML.

use std::fmt::Write;

use serde::Serialize;

/// A table: every row has one value for each column.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Table {
    pub title: String,
    /// Names, with the unit in brackets where there is one: `rate (Mbit/s)`.
    pub columns: Vec<String>,
    pub rows: Vec<Vec<Value>>,
    /// What a reader must know to read the figures; may be empty.
    pub note: String,
}

/// One entry of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Text(String),
    Count(u64),
    /// A figure that is shown with so many decimals, and written to CSV and JSON in full.
    Number(f64, usize),
    /// Nothing to report: empty in CSV, `null` in JSON, a dash on the page.
    Missing,
}

impl Value {
    /// A number shown with `decimals` decimals, or [`Value::Missing`].
    pub fn number(value: Option<f64>, decimals: usize) -> Value {
        value.map_or(Value::Missing, |v| Value::Number(v, decimals))
    }

    /// The text on a page.
    pub fn shown(&self) -> String {
        match self {
            Value::Text(text) => text.clone(),
            Value::Count(count) => grouped(*count),
            Value::Number(v, _) if v.is_nan() => "n/a".to_string(),
            Value::Number(v, _) if v.is_infinite() => {
                if *v > 0.0 {
                    "inf".to_string()
                } else {
                    "-inf".to_string()
                }
            }
            Value::Number(v, decimals) => format!("{v:.decimals$}"),
            Value::Missing => "\u{2013}".to_string(),
        }
    }

    fn csv(&self) -> String {
        match self {
            Value::Text(text) => csv_field(text),
            Value::Count(count) => count.to_string(),
            Value::Number(v, _) if v.is_finite() => v.to_string(),
            Value::Number(..) => csv_field(&self.shown()),
            Value::Missing => String::new(),
        }
    }
}

impl Serialize for Value {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Value::Text(text) => serializer.serialize_str(text),
            Value::Count(count) => serializer.serialize_u64(*count),
            Value::Number(v, _) => serializer.serialize_f64(*v),
            Value::Missing => serializer.serialize_none(),
        }
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Value {
        Value::Text(text.to_string())
    }
}

impl From<u64> for Value {
    fn from(count: u64) -> Value {
        Value::Count(count)
    }
}

impl Table {
    /// The table as CSV (RFC 4180, with line feeds), a header line first.
    pub fn to_csv(&self) -> String {
        let header = self
            .columns
            .iter()
            .map(|c| csv_field(c))
            .collect::<Vec<_>>()
            .join(",");
        let mut csv = header + "\n";
        for row in &self.rows {
            csv += &row.iter().map(Value::csv).collect::<Vec<_>>().join(",");
            csv.push('\n');
        }
        csv
    }

    /// The table as an HTML fragment. A column whose every value is text is set flush left.
    pub fn to_html(&self) -> String {
        let textual = |column: usize| {
            self.rows
                .iter()
                .all(|row| matches!(row.get(column), Some(Value::Text(_)) | None))
        };
        let class = |column: usize| {
            if textual(column) {
                " class=\"text\""
            } else {
                ""
            }
        };
        let mut html = String::from("<div class=\"table\"><table>");
        if !self.title.is_empty() {
            let _ = write!(html, "<caption>{}</caption>", escape(&self.title));
        }
        html += "<thead><tr>";
        for (i, column) in self.columns.iter().enumerate() {
            let _ = write!(
                html,
                "<th scope=\"col\"{}>{}</th>",
                class(i),
                escape(column)
            );
        }
        html += "</tr></thead><tbody>";
        for row in &self.rows {
            html += "<tr>";
            for (i, value) in row.iter().enumerate() {
                let _ = write!(html, "<td{}>{}</td>", class(i), escape(&value.shown()));
            }
            html += "</tr>";
        }
        html += "</tbody></table></div>\n";
        if !self.note.is_empty() {
            let _ = writeln!(html, "<p class=\"note\">{}</p>", escape(&self.note));
        }
        html
    }
}

/// A count with a thin space between groups of three digits.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{2009}');
        }
        text.push(digit);
    }
    text
}

/// Text for HTML and SVG, within elements and within quoted attributes. Control characters, which
/// XML does not allow, are replaced.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\'' => escaped += "&#39;",
            '\n' | '\t' => escaped.push(c),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => {
                escaped.push('\u{fffd}');
            }
            c => escaped.push(c),
        }
    }
    escaped
}

/// A CSV field, quoted where it must be.
pub fn csv_field(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        Table {
            title: "A <b> table".to_string(),
            columns: vec!["scene, camera".to_string(), "rate (Mbit/s)".to_string()],
            rows: vec![
                vec!["say \"hi\"".into(), Value::number(Some(1.0 / 3.0), 2)],
                vec!["two\nlines".into(), Value::Missing],
                vec!["plain".into(), Value::Count(1_234_567)],
            ],
            note: String::new(),
        }
    }

    #[test]
    fn csv_quotes_what_it_must_and_keeps_full_precision() {
        assert_eq!(
            table().to_csv(),
            "\"scene, camera\",rate (Mbit/s)\n\"say \"\"hi\"\"\",0.3333333333333333\n\
             \"two\nlines\",\nplain,1234567\n"
        );
    }

    #[test]
    fn html_escapes_everything() {
        let html = table().to_html();
        assert!(html.contains("A &lt;b&gt; table") && html.contains("say &quot;hi&quot;"));
        assert!(html.contains(">0.33<") && html.contains("1\u{2009}234\u{2009}567"));
        assert_eq!(escape("a\u{1}&'"), "a\u{fffd}&amp;&#39;");
    }

    #[test]
    fn json_has_plain_values() {
        let json = serde_json::to_value(table()).expect("serialised");
        assert!((json["rows"][0][1].as_f64().expect("number") - 1.0 / 3.0).abs() < 1e-15);
        assert!(json["rows"][1][1].is_null());
        let infinite = serde_json::to_value(Value::Number(f64::INFINITY, 2)).expect("serialised");
        assert!(infinite.is_null());
    }
}
