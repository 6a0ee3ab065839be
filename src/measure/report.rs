//! A report: one self-contained HTML page, and its figures as JSON.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;

use super::chart::Chart;
use super::table::{Table, escape};
use crate::render::image::Picture;
use crate::{Error, Result, base64, files};

/// What a report shows, from top to bottom.
#[derive(Clone, Debug, Default)]
pub struct Report {
    pub title: String,
    /// One line on what was measured: scene, camera, size, frames.
    pub subtitle: String,
    /// The figures to see first.
    pub figures: Vec<Figure>,
    pub sections: Vec<Section>,
    /// How the figures came about: commands, machine, caveats. One paragraph each.
    pub notes: Vec<String>,
}

/// A key figure.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    pub label: String,
    pub value: String,
    /// May be empty.
    pub unit: String,
    /// A few words below the figure; may be empty.
    pub note: String,
}

/// A part of the page; whatever is empty is not shown.
#[derive(Clone, Debug, Default)]
pub struct Section {
    pub title: String,
    pub text: String,
    /// Shown side by side where there is room.
    pub images: Vec<Image>,
    pub charts: Vec<Chart>,
    pub tables: Vec<Table>,
}

/// A picture with its caption.
#[derive(Clone, Debug)]
pub struct Image {
    pub caption: String,
    /// What follows the caption in gray, such as the picture's error; may be empty.
    pub detail: String,
    pub source: Source,
}

/// Where the page finds a picture.
#[derive(Clone, Debug)]
pub enum Source {
    /// Carried within the page.
    Embedded(Picture),
    /// A file by its path relative to the page.
    File(String),
}

/// Writes `index.html` and `report.json` into `folder`, which must exist. `data` is what
/// `report.json` holds; a float that is not finite becomes `null` there.
///
/// # Errors
/// `Io` where a file cannot be written, `Invalid` where a picture or `data` cannot be encoded.
pub fn write(report: &Report, data: &impl Serialize, folder: &Path) -> Result<()> {
    save(&folder.join("index.html"), &report.to_html()?)?;
    let json = serde_json::to_string_pretty(data)
        .map_err(|e| Error::Invalid(format!("the report's figures are no JSON ({e})")))?;
    save(&folder.join("report.json"), &(json + "\n"))
}

/// Writes a text file, whole or not at all.
///
/// # Errors
/// As [`files::write`].
pub fn save(path: &Path, text: &str) -> Result<()> {
    files::write(path, text.as_bytes())
}

impl Report {
    /// The page: styles, charts and embedded pictures included, no script.
    ///
    /// # Errors
    /// `Invalid` where an embedded picture cannot be encoded.
    pub fn to_html(&self) -> Result<String> {
        let title = escape(&self.title);
        let mut html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n\
             <header>\n<h1>{title}</h1>\n"
        );
        if !self.subtitle.is_empty() {
            let _ = writeln!(html, "<p class=\"subtitle\">{}</p>", escape(&self.subtitle));
        }
        html += "</header>\n";
        if !self.figures.is_empty() {
            html += "<dl class=\"figures\">\n";
            for figure in &self.figures {
                figure.to_html(&mut html);
            }
            html += "</dl>\n";
        }
        for section in &self.sections {
            section.to_html(&mut html)?;
        }
        if !self.notes.is_empty() {
            html += "<section class=\"notes\">\n<h2>Notes</h2>\n<ul>\n";
            for note in &self.notes {
                let _ = writeln!(html, "<li>{}</li>", escape(note));
            }
            html += "</ul>\n</section>\n";
        }
        Ok(html + "</main>\n</body>\n</html>\n")
    }
}

impl Figure {
    fn to_html(&self, html: &mut String) {
        let _ = write!(
            html,
            "<div><dt>{}</dt><dd>{}",
            escape(&self.label),
            escape(&self.value)
        );
        if !self.unit.is_empty() {
            let _ = write!(html, " <span class=\"unit\">{}</span>", escape(&self.unit));
        }
        *html += "</dd>";
        if !self.note.is_empty() {
            let _ = write!(html, "<dd class=\"note\">{}</dd>", escape(&self.note));
        }
        *html += "</div>\n";
    }
}

impl Section {
    fn to_html(&self, html: &mut String) -> Result<()> {
        *html += "<section>\n";
        if !self.title.is_empty() {
            let _ = writeln!(html, "<h2>{}</h2>", escape(&self.title));
        }
        if !self.text.is_empty() {
            let _ = writeln!(html, "<p>{}</p>", escape(&self.text));
        }
        if !self.images.is_empty() {
            *html += "<div class=\"images\">\n";
            for image in &self.images {
                image.to_html(html)?;
            }
            *html += "</div>\n";
        }
        if !self.charts.is_empty() {
            *html += "<div class=\"charts\">\n";
            for chart in &self.charts {
                let _ = write!(html, "<figure>\n{}</figure>\n", chart.to_svg());
            }
            *html += "</div>\n";
        }
        for table in &self.tables {
            *html += &table.to_html();
        }
        *html += "</section>\n";
        Ok(())
    }
}

impl Image {
    fn to_html(&self, html: &mut String) -> Result<()> {
        let caption = escape(&self.caption);
        let (source, size) = match &self.source {
            Source::Embedded(picture) => (
                format!(
                    "data:image/png;base64,{}",
                    base64::encode(&picture.to_png()?)
                ),
                format!(" width=\"{}\" height=\"{}\"", picture.width, picture.height),
            ),
            Source::File(path) => (url_path(path), String::new()),
        };
        let _ = write!(
            html,
            "<figure><img src=\"{source}\"{size} alt=\"{caption}\"><figcaption>{caption}"
        );
        if !self.detail.is_empty() {
            let _ = write!(
                html,
                " <span class=\"detail\">{}</span>",
                escape(&self.detail)
            );
        }
        *html += "</figcaption></figure>\n";
        Ok(())
    }
}

/// A relative path as a URL: bytes that are neither unreserved nor a slash are escaped, and a
/// leading `./` keeps a name with a colon from being read as a scheme.
fn url_path(path: &str) -> String {
    let mut url = String::from("./");
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~/".contains(&byte) {
            url.push(char::from(byte));
        } else {
            let _ = write!(url, "%{byte:02X}");
        }
    }
    url
}

const STYLE: &str = include_str!("report.css");

#[cfg(test)]
mod tests;
