//! Regions from a JSON file. `docs/regions.md` has its schema.

use super::graph::{Graph, Link, Region, boundaries, links, open_links, reach};
use super::space::Space;
use crate::trace::{Aabb, Tracer};
use crate::{Error, Result};
use glam::Vec3;
use serde::Deserialize;
use std::collections::{BTreeSet, HashMap};

/// Most regions of a track of the format.
pub const MAX_REGIONS: usize = 1 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    regions: Vec<BoxOfFile>,
    #[serde(default)]
    links: Option<Vec<[String; 2]>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoxOfFile {
    name: String,
    min: [f32; 3],
    max: [f32; 3],
}

/// Regions as a file gives them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Given {
    pub regions: Vec<Region>,
    /// Pairs of regions, the lower number first, ascending; `None` where all that open into each other
    /// are linked.
    pub links: Option<Vec<[usize; 2]>>,
}

/// Reads the text of a file; `name` is what errors call it.
///
/// # Errors
/// `Invalid`, one sentence, where the text is no JSON of that shape, there is no region or more than
/// [`MAX_REGIONS`], two have one name, a box is none, or a link names a region that is not there, one
/// region twice, or two whose boxes do not touch.
pub fn parse(name: &str, text: &str) -> Result<Given> {
    let invalid = |message: String| Error::Invalid(format!("{name}: {message}"));
    let document: Document =
        serde_json::from_str(text).map_err(|error| invalid(error.to_string()))?;
    let count = document.regions.len();
    if count == 0 || count > MAX_REGIONS {
        return Err(invalid(format!(
            "it has {count} regions; there must be 1 to {MAX_REGIONS}"
        )));
    }
    let mut numbers = HashMap::new();
    let mut regions = Vec::with_capacity(count);
    for BoxOfFile { name, min, max } in document.regions {
        let bounds = Aabb {
            min: Vec3::from(min),
            max: Vec3::from(max),
        };
        if !bounds.min.is_finite() || !bounds.max.is_finite() {
            return Err(invalid(format!(
                "region \"{name}\" has a coordinate that is no finite number"
            )));
        }
        if bounds.is_empty() {
            return Err(invalid(format!(
                "region \"{name}\" has a min that is greater than its max"
            )));
        }
        if numbers.insert(name.clone(), regions.len()).is_some() {
            return Err(invalid(format!("two regions have the name \"{name}\"")));
        }
        regions.push(Region { name, bounds });
    }
    let Some(named) = document.links else {
        return Ok(Given {
            regions,
            links: None,
        });
    };
    let mut pairs = BTreeSet::new();
    for link in &named {
        let find = |name: &String| {
            numbers.get(name).copied().ok_or_else(|| {
                invalid(format!(
                    "a link names the region \"{name}\", which is not there"
                ))
            })
        };
        let [a, b] = [find(&link[0])?, find(&link[1])?];
        if a == b {
            return Err(invalid(format!(
                "a link joins the region \"{}\" to itself",
                link[0]
            )));
        }
        pairs.insert([a.min(b), a.max(b)]);
    }
    for pair in &pairs {
        let [a, b] = pair.map(|i| &regions[i]);
        if boundaries(&a.bounds, &b.bounds).is_empty() {
            return Err(invalid(format!(
                "a link joins the regions \"{}\" and \"{}\", whose boxes share no boundary",
                a.name, b.name
            )));
        }
    }
    Ok(Given {
        regions,
        links: Some(pairs.into_iter().collect()),
    })
}

impl Given {
    /// The graph in a space that was flooded from these regions, too ([`Given::seeds`]). Links that were
    /// named stand even where nothing passes: their boundary is then all that the boxes share.
    ///
    /// # Errors
    /// `Invalid` where a region overlaps nothing of the space.
    pub fn graph(self, tracer: &Tracer, space: &Space) -> Result<Graph> {
        for region in &self.regions {
            if !space.overlaps(&region.bounds) {
                return Err(Error::Invalid(format!(
                    "region \"{}\" overlaps no free space of the scene",
                    region.name
                )));
            }
        }
        let regions = self.regions;
        let links = match self.links {
            None => links(tracer, space, &regions),
            Some(pairs) => pairs
                .iter()
                .flat_map(|pair| named(tracer, space, &regions, *pair))
                .collect(),
        };
        Ok(Graph { regions, links })
    }

    /// Where the flood begins besides the eyes of cameras: in the middle of the boxes.
    pub fn seeds(&self) -> Vec<Vec3> {
        self.regions.iter().map(|r| r.bounds.centre()).collect()
    }
}

/// The links of two regions that were named: of what is open, else of all that they share.
fn named(tracer: &Tracer, space: &Space, regions: &[Region], pair: [usize; 2]) -> Vec<Link> {
    let boxes = pair.map(|i| &regions[i].bounds);
    let boundaries = boundaries(boxes[0], boxes[1]);
    let open: Vec<Link> = boundaries
        .iter()
        .flat_map(|boundary| {
            let reach = reach(space, boxes, boundary.axis);
            open_links(tracer, space, pair, boundary, reach)
        })
        .collect();
    let whole = boundaries.iter().map(|boundary| Link {
        regions: pair,
        area: boundary.area(),
        centre: boundary.bounds.centre(),
    });
    match open.is_empty() {
        true => whole.collect(),
        false => open,
    }
}
