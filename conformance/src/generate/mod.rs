//! The vectors of this repository, from code: the same bytes on every machine. Each says what it
//! expects by hand; what the reference decoder makes of it is only checked against that.

mod container;
pub mod draw;
pub mod expected;
pub mod frames;
mod limits;
mod packing;
pub(crate) mod plan;
mod records;
mod sessions;
mod tracks;

use std::collections::BTreeMap;

use crate::models::{self, Query};
use crate::protocol::{Arguments, Mode, Program as _, split};
use crate::reference::Reference;
use crate::vector::{Class, Info, Kind, Vector, sha256};

/// All vectors, in the order of their paths.
///
/// # Errors
/// A sentence for each vector of which the reference decoder makes something else than it says.
pub fn all() -> Result<Vec<Vector>, String> {
    let mut drafts = Vec::new();
    container::add(&mut drafts);
    records::add(&mut drafts);
    limits::add(&mut drafts);
    sessions::add(&mut drafts);
    models::generate(&mut drafts)?;
    let (mut vectors, mut wrong) = (Vec::new(), Vec::new());
    for draft in drafts {
        match draft.finish() {
            Ok(vector) => vectors.push(vector),
            Err(error) => wrong.push(error),
        }
    }
    if !wrong.is_empty() {
        return Err(wrong.join("\n"));
    }
    vectors.sort_by_key(Vector::path);
    if let Some(twice) = vectors
        .windows(2)
        .find(|pair| pair[0].path() == pair[1].path())
    {
        return Err(format!("{}: two vectors of this name", twice[0].path()));
    }
    Ok(vectors)
}

/// A vector before its hashes.
#[derive(Clone, Debug)]
pub struct Draft {
    area: &'static str,
    kind: Kind,
    name: String,
    clauses: Vec<&'static str>,
    class: Class,
    comment: String,
    bytes: Vec<u8>,
    limits: BTreeMap<String, u64>,
    live: bool,
    /// Error number and offset.
    error: Option<(u16, u64)>,
    queries: Vec<Query>,
    /// The lines `values` and `visibility` that its dump must have, where that is known.
    shown: Option<Vec<String>>,
}

impl Draft {
    /// A stream that is decoded to its end.
    pub fn valid(
        area: &'static str,
        name: &str,
        clauses: &[&'static str],
        comment: &str,
        bytes: Vec<u8>,
    ) -> Draft {
        Draft {
            area,
            kind: Kind::Valid,
            name: name.to_string(),
            clauses: clauses.to_vec(),
            class: Class::Value,
            comment: comment.to_string(),
            bytes,
            limits: BTreeMap::new(),
            live: false,
            error: None,
            queries: Vec::new(),
            shown: None,
        }
    }

    /// A stream that is refused with `id` at byte `offset`; `fault` completes its name.
    pub fn invalid(
        area: &'static str,
        (id, fault): (u16, &str),
        offset: usize,
        clauses: &[&'static str],
        comment: &str,
        bytes: Vec<u8>,
    ) -> Draft {
        Draft {
            kind: Kind::Invalid,
            class: Class::Reject,
            error: Some((id, offset as u64)),
            ..Draft::valid(area, &format!("E{id}-{fault}"), clauses, comment, bytes)
        }
    }

    /// A session script (its transcript comes from the reference decoder).
    pub fn session(
        area: &'static str,
        name: &str,
        clauses: &[&'static str],
        comment: &str,
        script: Vec<u8>,
    ) -> Draft {
        Draft {
            kind: Kind::Sessions,
            class: Class::Behaviour,
            ..Draft::valid(area, name, clauses, comment, script)
        }
    }

    /// A stream with look-ups.
    pub fn query(
        area: &'static str,
        name: &str,
        clauses: &[&'static str],
        comment: &str,
        bytes: Vec<u8>,
        queries: Vec<Query>,
    ) -> Draft {
        Draft {
            kind: Kind::Queries,
            queries,
            ..Draft::valid(area, name, clauses, comment, bytes)
        }
    }

    /// Under a limit; puts it among the limits.
    pub fn limit(mut self, name: &str, value: u64) -> Draft {
        self.kind = Kind::Limits;
        self.limits.insert(name.to_string(), value);
        self
    }

    /// With what clients see of its probes.
    pub fn shows(mut self, lines: &[String]) -> Draft {
        self.shown = Some(lines.to_vec());
        self
    }

    /// As a live stream.
    pub fn live(mut self) -> Draft {
        self.live = true;
        self
    }

    fn finish(self) -> Result<Vector, String> {
        let place = format!("{}/{}/{}", self.area, self.kind.folder(), self.name);
        let arguments = Arguments {
            mode: if self.kind == Kind::Sessions {
                Mode::Session
            } else {
                Mode::Stream
            },
            limits: self.limits.clone(),
            live: self.live,
            ..Arguments::default()
        };
        let answer = Reference::default().request(&arguments, &self.bytes);
        let answer = answer.map_err(|e| format!("{place}: {e}"))?;
        let (output, fault) = split(&answer);
        let found = fault.as_ref().map(|fault| (fault.id, fault.offset));
        if found != self.error {
            return Err(format!(
                "{place}: the reference decoder gives {found:?}, the vector says {:?}",
                self.error
            ));
        }
        if let Some(expected) = &self.shown {
            let lines = String::from_utf8_lossy(output);
            let lines = lines.lines();
            let shown = |line: &&str| line.starts_with("values ") || line.starts_with("visib");
            let differs = lines.filter(shown).zip(expected);
            if let Some((line, expected)) =
                differs.clone().find(|(line, expected)| line != expected)
            {
                return Err(format!("{place}: {line}, not {expected}"));
            }
            if differs.count() != expected.len() {
                return Err(format!("{place}: too few lines of values"));
            }
        }
        let hash = Some(sha256(output));
        let session = self.kind == Kind::Sessions;
        let info = Info {
            clauses: self.clauses.iter().map(ToString::to_string).collect(),
            since: 1,
            class: self.class,
            comment: self.comment,
            limits: self.limits,
            live: self.live,
            dump_sha256: hash.clone().filter(|_| !session && fault.is_none()),
            released_sha256: hash.clone().filter(|_| !session && fault.is_some()),
            transcript_sha256: hash.filter(|_| session),
            error: fault,
            queries: self.queries,
            bytes: self.bytes.len() as u64,
            sha256: sha256(&self.bytes),
        };
        Ok(Vector {
            area: self.area.to_string(),
            kind: self.kind,
            name: self.name,
            bytes: self.bytes,
            info,
        })
    }
}
