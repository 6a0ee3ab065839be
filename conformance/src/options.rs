//! Levels of conformance, and the options of a run.

use std::collections::BTreeMap;
use std::str::FromStr;

/// A level of conformance. A decoder passes a level when it passes all vectors of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Accepts or refuses as it must, with the dump that it must.
    Core,
    /// Names the layer, number and offset of each fault.
    Full,
    /// Goes on after losses and faults.
    Sessions,
    /// Keeps limits that are set for it.
    Limits,
    /// Samples light at surface positions.
    Queries,
}

impl Level {
    /// All, in the order in which a decoder comes by them.
    pub const ALL: [Level; 5] = [
        Level::Core,
        Level::Full,
        Level::Sessions,
        Level::Limits,
        Level::Queries,
    ];

    /// Its name in arguments and reports.
    pub fn name(self) -> &'static str {
        match self {
            Level::Core => "core",
            Level::Full => "full",
            Level::Sessions => "sessions",
            Level::Limits => "limits",
            Level::Queries => "queries",
        }
    }
}

impl FromStr for Level {
    type Err = String;

    fn from_str(name: &str) -> Result<Level, String> {
        let mut levels = Level::ALL.into_iter();
        let named = levels.find(|level| level.name() == name);
        named.ok_or_else(|| format!("{name}: no such level"))
    }
}

/// Step of [`Extent::Sample`]: odd, so that all bits of a byte have a turn.
pub const SAMPLE_STEP: usize = 29;

/// How many prefixes or single-bit flips of a vector are tried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Extent {
    /// None.
    #[default]
    None,
    /// One in [`SAMPLE_STEP`].
    Sample,
    /// Every one.
    All,
}

impl Extent {
    /// All, from nothing to everything.
    pub const ALL: [Extent; 3] = [Extent::None, Extent::Sample, Extent::All];

    /// Its name in arguments.
    pub fn name(self) -> &'static str {
        match self {
            Extent::None => "none",
            Extent::Sample => "sample",
            Extent::All => "all",
        }
    }

    /// The step from one that is tried to the next.
    pub fn step(self) -> Option<usize> {
        match self {
            Extent::None => None,
            Extent::Sample => Some(SAMPLE_STEP),
            Extent::All => Some(1),
        }
    }
}

impl FromStr for Extent {
    type Err = String;

    fn from_str(name: &str) -> Result<Extent, String> {
        let mut extents = Extent::ALL.into_iter();
        let named = extents.find(|extent| extent.name() == name);
        named.ok_or_else(|| format!("{name}: no such extent"))
    }
}

/// The options of a run.
#[derive(Clone, Debug)]
pub struct Options {
    /// Levels; [`Level::Full`] takes [`Level::Core`] with it.
    pub levels: Vec<Level>,
    /// Proper prefixes of streams up to 4 KiB; of larger ones a few.
    pub prefixes: Extent,
    /// Single-bit flips of valid vectors up to 4 KiB.
    pub flips: Extent,
    /// The decoder knows `--partial`. Where it does not, a few prefixes are tried.
    pub partial: bool,
    /// Verdicts on prefixes and flips are compared with those of the reference decoder, which
    /// is of use for any other decoder.
    pub compare: bool,
    /// Vectors that may fail, by path, with the reasons.
    pub skips: BTreeMap<String, String>,
    /// Only vectors with one of these in their path; all where there is none.
    pub filters: Vec<String>,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            levels: Level::ALL.to_vec(),
            prefixes: Extent::Sample,
            flips: Extent::None,
            partial: true,
            compare: true,
            skips: BTreeMap::new(),
            filters: Vec::new(),
        }
    }
}

impl Options {
    /// Whether the filters take the vector of a path.
    pub fn takes(&self, path: &str) -> bool {
        let mut filters = self.filters.iter();
        self.filters.is_empty() || filters.any(|filter| path.contains(filter))
    }
}
