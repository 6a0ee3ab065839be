//! A bake that is shared out: tasks that write parts, and their merge.

use crate::bake::part::{self, Merge};
use crate::bake::{Plan, Traced};
use crate::files::{self, NewFile};
use crate::{Error, Result};
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// How the names of parts end.
const EXTENSION: &str = "bakepart";

#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Farm")]
pub struct FarmArgs {
    /// Do task I of N alone, counted from 1, and write its part into --parts; `slurm` takes both from
    /// SLURM_ARRAY_TASK_ID and its count.
    #[arg(long, value_name = "I/N", requires = "parts")]
    task: Option<TaskNumber>,
    /// Folder for the parts of tasks; missing folders are made.
    #[arg(long, value_name = "DIR")]
    parts: Option<PathBuf>,
    /// Do nothing where the task's part is there and whole.
    #[arg(long)]
    resume: bool,
    /// Take what tasks have traced from their parts: files, or folders of them.
    #[arg(long, value_name = "PARTS", num_args = 1.., conflicts_with_all = ["task", "parts"])]
    merge: Vec<PathBuf>,
}

/// What this run is to a farm.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Farm {
    None,
    Task(Task),
    Merge(Vec<PathBuf>),
}

/// One of several tasks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Task {
    /// From 0.
    pub index: usize,
    pub tasks: usize,
    folder: PathBuf,
    resume: bool,
}

/// A task as the user names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TaskNumber {
    /// From 1, of so many.
    Of(u32, u32),
    Slurm,
}

impl std::str::FromStr for TaskNumber {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<TaskNumber, String> {
        if text == "slurm" {
            return Ok(TaskNumber::Slurm);
        }
        let numbers = text.split_once('/');
        let numbers = numbers.and_then(|(i, n)| i.parse::<u32>().ok().zip(n.parse::<u32>().ok()));
        match numbers {
            Some((i, n)) if (1..=n).contains(&i) => Ok(TaskNumber::Of(i, n)),
            Some((i, n)) if n > 0 => Err(format!("there is no task {i} of {n}: they are 1 to {n}")),
            _ => Err("expected a task and their number, such as 3/8, or slurm".into()),
        }
    }
}

impl TaskNumber {
    /// The index from 0 and the number of tasks; `variable` looks an environment variable up.
    fn resolve(self, variable: impl Fn(&str) -> Option<String>) -> Result<(usize, usize)> {
        match self {
            TaskNumber::Of(i, n) => Ok((i as usize - 1, n as usize)),
            TaskNumber::Slurm => {
                let number = |name: &str| {
                    let text = variable(&format!("SLURM_ARRAY_TASK_{name}"))?;
                    text.trim().parse::<usize>().ok()
                };
                let first = number("MIN").unwrap_or(0);
                let step = number("STEP").unwrap_or(1).max(1);
                let index = number("ID").and_then(|id| id.checked_sub(first));
                let found = index.map(|index| index / step).zip(number("COUNT"));
                found.filter(|(index, tasks)| index < tasks).ok_or_else(|| {
                    Error::Usage(
                        "--task slurm is for tasks of a job array: SLURM_ARRAY_TASK_ID and \
                         SLURM_ARRAY_TASK_COUNT are not set, or do not fit"
                            .into(),
                    )
                })
            }
        }
    }
}

impl FarmArgs {
    /// # Errors
    /// `Usage` for `--task slurm` outside a job array.
    pub fn farm(&self) -> Result<Farm> {
        if let (Some(task), Some(folder)) = (self.task, &self.parts) {
            let (index, tasks) = task.resolve(|name| std::env::var(name).ok())?;
            return Ok(Farm::Task(Task {
                index,
                tasks,
                folder: folder.clone(),
                resume: self.resume,
            }));
        }
        Ok(match self.merge.is_empty() {
            true => Farm::None,
            false => Farm::Merge(self.merge.clone()),
        })
    }
}

impl Task {
    /// The file of the task's part. Its name has the key of the bake, so that parts of different bakes
    /// do not replace each other.
    pub fn part(&self, key: u64) -> PathBuf {
        let (number, tasks) = (self.index + 1, self.tasks);
        let name = format!("{key:016x}-{number:04}-of-{tasks:04}.{EXTENSION}");
        self.folder.join(name)
    }

    /// Whether the part is there and whole and may stay.
    pub fn is_done(&self, key: u64) -> bool {
        let read = || std::fs::read(self.part(key)).ok();
        self.resume && read().is_some_and(|bytes| part::check(&bytes, key).is_ok())
    }

    /// Starts the part: before the work, so that a folder that cannot be written is told at once.
    ///
    /// # Errors
    /// As [`NewFile::create`].
    pub fn create(&self, key: u64) -> Result<NewFile> {
        NewFile::create(&self.part(key))
    }
}

/// Writes a part, which appears whole or not at all.
///
/// # Errors
/// As [`NewFile::finish`].
pub fn write_part(
    mut file: NewFile,
    plan: &Plan,
    key: u64,
    items: Range<usize>,
    traced: &[Traced],
) -> Result<()> {
    let bytes = part::write(plan, key, items, traced);
    file.write_all(&bytes).map_err(|e| file.error(e))?;
    file.finish()
}

/// What the tasks of all parts traced.
///
/// # Errors
/// `Io` for what cannot be read; `Invalid` for a file that is no part of this bake, and where parts are
/// missing.
pub fn merge(paths: &[PathBuf], plan: &Plan, key: u64) -> Result<Vec<Traced>> {
    let mut merge = Merge::new(plan, key);
    for path in paths {
        for path in files_of(path)? {
            let bytes = std::fs::read(&path).map_err(|source| Error::Io {
                path: path.clone(),
                source,
            })?;
            files::protect(&path);
            merge
                .add(&bytes)
                .map_err(|what| Error::Invalid(format!("{}: {what}", path.display())))?;
        }
    }
    merge.finish().map_err(Error::Invalid)
}

/// A file, or the parts in a folder, by name.
fn files_of(path: &Path) -> Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let io = |source| Error::Io {
        path: path.to_owned(),
        source,
    };
    let mut parts = Vec::new();
    for entry in path.read_dir().map_err(io)? {
        let file = entry.map_err(io)?.path();
        if file.extension().is_some_and(|e| e == EXTENSION) {
            parts.push(file);
        }
    }
    if parts.is_empty() {
        return Err(Error::Invalid(format!(
            "{}: there are no parts (*.{EXTENSION}) in this folder",
            path.display()
        )));
    }
    parts.sort();
    Ok(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn task_numbers_are_checked() {
        for (text, expected) in [
            ("1/1", Some(TaskNumber::Of(1, 1))),
            ("3/8", Some(TaskNumber::Of(3, 8))),
            ("slurm", Some(TaskNumber::Slurm)),
            ("9/8", None),
            ("0/8", None),
            ("1/0", None),
            ("0/0", None),
            ("-1/8", None),
            ("1", None),
            ("a/b", None),
        ] {
            assert_eq!(text.parse().ok(), expected, "{text}");
        }
    }

    #[test]
    fn slurm_arrays_may_begin_and_step_anywhere() {
        let slurm = |id: &str, count: &str, min: &str, step: &str| {
            let get = |name: &str| {
                let value = match name {
                    "SLURM_ARRAY_TASK_ID" => id,
                    "SLURM_ARRAY_TASK_COUNT" => count,
                    "SLURM_ARRAY_TASK_MIN" => min,
                    "SLURM_ARRAY_TASK_STEP" => step,
                    _ => "",
                };
                (!value.is_empty()).then(|| value.to_owned())
            };
            TaskNumber::Slurm.resolve(get).ok()
        };
        assert_eq!(slurm("0", "8", "0", "1"), Some((0, 8)));
        assert_eq!(slurm("8", "8", "1", "1"), Some((7, 8)));
        assert_eq!(slurm("14", "4", "8", "2"), Some((3, 4)));
        assert_eq!(slurm("7", "8", "", ""), Some((7, 8)));
        assert_eq!(slurm("8", "8", "0", "1"), None);
        assert_eq!(slurm("0", "8", "1", "1"), None);
        assert_eq!(slurm("", "", "", ""), None);
    }
}
