//! A conformance vector: bytes, and the JSON beside them that says what a decoder makes of them.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::models::Query;
use crate::protocol::{self, Fault};

/// What sort of vector it is: the folder it lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A stream that is decoded to its end.
    Valid,
    /// A stream with one fault.
    Invalid,
    /// A stream that asks for as much as a limit allows, or for more.
    Limits,
    /// A script of pushes, losses and resumptions.
    Sessions,
    /// A stream, and what its content looks like from given surface positions.
    Queries,
}

impl Kind {
    /// All, in the order of their folders' use.
    pub const ALL: [Kind; 5] = [
        Kind::Valid,
        Kind::Invalid,
        Kind::Limits,
        Kind::Sessions,
        Kind::Queries,
    ];

    /// Name of the folder.
    pub fn folder(self) -> &'static str {
        match self {
            Kind::Valid => "valid",
            Kind::Invalid => "invalid",
            Kind::Limits => "limits",
            Kind::Sessions => "sessions",
            Kind::Queries => "queries",
        }
    }
}

/// The class of a clause, or of a vector: what a decoder does with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Class {
    /// Refused with an error.
    Reject,
    /// Decoded or looked up in: a decoder that gets it wrong gives another dump or AO.
    Value,
    /// What a decoder does, and not what it shows: of vectors, the sessions.
    Behaviour,
}

impl Class {
    /// Its name in the specification.
    pub fn name(self) -> &'static str {
        match self {
            Class::Reject => "reject",
            Class::Value => "value",
            Class::Behaviour => "behaviour",
        }
    }
}

/// The JSON beside a vector. `conformance/vectors/vector.schema.json` is its schema.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Info {
    /// Clauses that it holds a decoder to, such as `C-017`.
    pub clauses: Vec<String>,
    /// Container version that it first came with.
    pub since: u16,
    /// What it comes to.
    pub class: Class,
    /// What it shows, in a sentence.
    pub comment: String,
    /// Limits other than the defaults, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub limits: BTreeMap<String, u64>,
    /// The input may stop after any commit.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub live: bool,
    /// The fault, where a decoder must refuse it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<Fault>,
    /// SHA-256 of the canonical dump of a stream without a fault.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dump_sha256: Option<String>,
    /// SHA-256 of the dump of what was released before the fault.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub released_sha256: Option<String>,
    /// SHA-256 of a session's transcript.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transcript_sha256: Option<String>,
    /// Look-ups of a query vector.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub queries: Vec<Query>,
    /// Length of the file.
    pub bytes: u64,
    /// SHA-256 of the file.
    pub sha256: String,
}

/// A vector with its bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Vector {
    /// Folder of the chapter: `container`, `points`.
    pub area: String,
    /// Folder of the kind.
    pub kind: Kind,
    /// File name without its extension.
    pub name: String,
    /// The stream or script.
    pub bytes: Vec<u8>,
    /// The JSON.
    pub info: Info,
}

impl Vector {
    /// Its path below the folder of vectors, without extension.
    pub fn path(&self) -> String {
        format!("{}/{}/{}", self.area, self.kind.folder(), self.name)
    }
}

/// Lower-case hexadecimal SHA-256.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

/// The vectors of this repository.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("vectors")
}

/// Reads all vectors below a folder, in the order of their paths. The files are untrusted input.
///
/// # Errors
/// A sentence that names the file which cannot be read, is no such JSON, says what does not fit its
/// kind, does not have the hash that its JSON states, or, where the folder has a manifest, is not
/// the file that the manifest names, or is too many.
pub fn load(folder: &Path) -> Result<Vec<Vector>, String> {
    let found = found(folder)?;
    check_manifest(folder, &found)?;
    let mut vectors = Vec::new();
    for (area, kind, path) in found.values() {
        if path.extension().is_some_and(|e| e == "json") {
            vectors.push(read(area, *kind, path)?);
        }
    }
    if vectors.is_empty() {
        return Err(format!("{}: no vectors there", folder.display()));
    }
    vectors.sort_by_key(Vector::path);
    Ok(vectors)
}

/// The list of all files of vectors.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    container_version: u16,
    /// SHA-256 by path.
    files: BTreeMap<String, String>,
}

/// Compares the files of vectors with the manifest, if there is one.
fn check_manifest(folder: &Path, found: &Found) -> Result<(), String> {
    let place = folder.join(MANIFEST);
    if !place.exists() {
        return Ok(());
    }
    let text = fs::read(&place).map_err(|e| at(&place, e))?;
    let manifest: Manifest =
        serde_json::from_slice(&text).map_err(|e| format!("{}: {e}", place.display()))?;
    for (name, hash) in &manifest.files {
        let Some((_, _, path)) = found.get(name) else {
            return Err(format!("{name:?} of {MANIFEST} is not there"));
        };
        let bytes = fs::read(path).map_err(|e| at(path, e))?;
        if sha256(&bytes) != *hash {
            return Err(format!("{}: not the file of {MANIFEST}", path.display()));
        }
    }
    let mut unlisted = found.iter();
    match unlisted.find(|(name, _)| !manifest.files.contains_key(*name)) {
        Some((_, (_, _, path))) => Err(format!("{}: not in {MANIFEST}", path.display())),
        None => Ok(()),
    }
}

fn read(area: &str, kind: Kind, json: &Path) -> Result<Vector, String> {
    let name = json.file_stem().unwrap_or_default().to_string_lossy();
    let text = fs::read(json).map_err(|e| at(json, e))?;
    let wrong = |sentence: String| format!("{}: {sentence}", json.display());
    let info: Info = serde_json::from_slice(&text).map_err(|e| wrong(e.to_string()))?;
    check(kind, &info).map_err(wrong)?;
    let path = json.with_extension("dapple");
    let bytes = fs::read(&path).map_err(|e| at(&path, e))?;
    if bytes.len() as u64 != info.bytes || sha256(&bytes) != info.sha256 {
        return Err(format!(
            "{}: not the file that {name}.json was written for",
            path.display()
        ));
    }
    Ok(Vector {
        area: area.to_string(),
        kind,
        name: name.into_owned(),
        bytes,
        info,
    })
}

/// Whether a decoder can be tested with this: limits that exist, and what a vector of the kind states.
fn check(kind: Kind, info: &Info) -> Result<(), String> {
    protocol::limits(&info.limits)?;
    let hashes = [
        &info.dump_sha256,
        &info.released_sha256,
        &info.transcript_sha256,
    ];
    let stated = (info.error.is_some(), hashes.map(Option::is_some));
    let accepted = stated == (false, [true, false, false]);
    let refused = stated == (true, [false, true, false]);
    let (fits, rule) = match kind {
        Kind::Valid => (accepted, "dump_sha256 alone"),
        Kind::Queries => (accepted, "dump_sha256 alone"),
        Kind::Invalid => (refused, "error and released_sha256"),
        Kind::Limits => (
            accepted || refused,
            "dump_sha256, or error and released_sha256",
        ),
        Kind::Sessions => (
            stated == (false, [false, false, true]),
            "transcript_sha256 alone",
        ),
    };
    if !fits {
        let folder = kind.folder();
        return Err(format!("a vector of {folder} states {rule}"));
    }
    if info.queries.is_empty() == (kind == Kind::Queries) {
        return Err("queries belong to vectors of queries, and to each of them".to_string());
    }
    Ok(())
}

fn sub_folders(folder: &Path) -> Result<Vec<String>, String> {
    let names = files(folder)?.into_iter().filter(|path| path.is_dir());
    Ok(names
        .filter_map(|path| Some(path.file_name()?.to_str()?.to_string()))
        .collect())
}

fn files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|e| at(folder, e))?;
    let mut paths = entries
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<io::Result<Vec<_>>>()
        .map_err(|e| at(folder, e))?;
    paths.sort();
    Ok(paths)
}

fn at(path: &Path, error: io::Error) -> String {
    format!("{}: {error}", path.display())
}

/// The files that vectors are kept in, by path below their folder, the manifest among them.
pub fn files_of(vectors: &[Vector]) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for vector in vectors {
        files.insert(format!("{}.dapple", vector.path()), vector.bytes.clone());
        files.insert(format!("{}.json", vector.path()), json(&vector.info));
    }
    let hashes = files.iter();
    let manifest = Manifest {
        container_version: 1,
        files: hashes
            .map(|(path, bytes)| (path.clone(), sha256(bytes)))
            .collect(),
    };
    files.insert(MANIFEST.to_string(), json(&manifest));
    files
}

/// Name of the file with the hashes of all others.
pub const MANIFEST: &str = "manifest.json";

fn json(value: &impl Serialize) -> Vec<u8> {
    // Numbers, strings and lists only: this cannot fail.
    let mut text = serde_json::to_vec_pretty(value).unwrap_or_default();
    text.push(b'\n');
    text
}

/// Writes the files and removes vectors that are not among them.
///
/// # Errors
/// A sentence that names the file.
pub fn write(folder: &Path, files: &BTreeMap<String, Vec<u8>>) -> Result<(), String> {
    for path in unexpected(folder, files)? {
        fs::remove_file(&path).map_err(|e| at(&path, e))?;
    }
    for (name, bytes) in files {
        let path = folder.join(name);
        if fs::read(&path).is_ok_and(|old| old == *bytes) {
            continue;
        }
        let parent = path.parent().unwrap_or(folder);
        fs::create_dir_all(parent).map_err(|e| at(parent, e))?;
        fs::write(&path, bytes).map_err(|e| at(&path, e))?;
    }
    Ok(())
}

/// Whether a folder holds exactly these files.
///
/// # Errors
/// A sentence that names the first file that is missing, differs or is too many.
pub fn compare(folder: &Path, files: &BTreeMap<String, Vec<u8>>) -> Result<(), String> {
    for (name, bytes) in files {
        let path = folder.join(name);
        let found = fs::read(&path).map_err(|e| at(&path, e))?;
        if found != *bytes {
            return Err(format!("{}: not what the generator writes", path.display()));
        }
    }
    match unexpected(folder, files)?.first() {
        None => Ok(()),
        Some(path) => Err(format!(
            "{}: the generator writes no such file",
            path.display()
        )),
    }
}

/// Files in the folders of vectors that are not among these.
fn unexpected(folder: &Path, expected: &BTreeMap<String, Vec<u8>>) -> Result<Vec<PathBuf>, String> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let mut found = found(folder)?;
    found.retain(|name, _| !expected.contains_key(name));
    Ok(found.into_values().map(|(_, _, path)| path).collect())
}

/// Area, kind and place of files, by path below the folder of vectors.
type Found = BTreeMap<String, (String, Kind, PathBuf)>;

/// All files in the folders of vectors.
fn found(folder: &Path) -> Result<Found, String> {
    let mut found = Found::new();
    for area in sub_folders(folder)? {
        for kind in Kind::ALL {
            let place = format!("{area}/{}", kind.folder());
            if !folder.join(&place).is_dir() {
                continue;
            }
            for path in files(&folder.join(&place))? {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                found.insert(format!("{place}/{name}"), (area.clone(), kind, path));
            }
        }
    }
    Ok(found)
}
