//! Output files that appear whole or not at all.
//!
//! A [`NewFile`] is written under a temporary name in the folder of its path and renamed at the end:
//! an error or an interruption leaves the old file as it was. An input of the program that was named
//! to [`protect`] is never replaced.

use crate::{Error, Result};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Most symbolic links that are followed to an output, as many as Linux follows.
const MAX_LINKS: usize = 40;

/// Files of this process that must not be lost and files that must not stay.
#[derive(Debug)]
struct Registry {
    /// Paths of inputs, without links: see [`protect`].
    inputs: Vec<PathBuf>,
    /// Temporary names, each with the path that it becomes.
    unfinished: Vec<(PathBuf, PathBuf)>,
    /// Temporary names given so far.
    names: u64,
}

static REGISTRY: Mutex<Registry> = Mutex::new(Registry {
    inputs: Vec::new(),
    unfinished: Vec::new(),
    names: 0,
});

fn registry() -> MutexGuard<'static, Registry> {
    REGISTRY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What tells whether two paths lead to one file.
#[derive(Debug, PartialEq, Eq)]
struct FileId {
    /// Without links and `..`.
    path: PathBuf,
    /// Device and inode: hard links share them.
    #[cfg(unix)]
    inode: (u64, u64),
}

impl FileId {
    /// `None` for what is not there or not a regular file.
    fn of(path: &Path) -> Option<FileId> {
        let metadata = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
        #[cfg(not(unix))]
        let _ = metadata;
        Some(FileId {
            path: fs::canonicalize(path).ok()?,
            #[cfg(unix)]
            inode: {
                use std::os::unix::fs::MetadataExt;
                (metadata.dev(), metadata.ino())
            },
        })
    }

    fn is_same_file(&self, other: &FileId) -> bool {
        #[cfg(unix)]
        if self.inode == other.inode {
            return true;
        }
        self.path == other.path
    }
}

/// Keeps a file that the program reads from being replaced by an output, under any of its names,
/// until the program ends. A path where no regular file is needs no protection.
pub fn protect(input: &Path) {
    if let Some(id) = FileId::of(input) {
        registry().inputs.push(id.path);
    }
}

/// Removes the temporary files of all unfinished outputs, and blocks new ones: for a program that is
/// about to end before its outputs are finished.
pub fn abandon() {
    let registry = registry();
    for (temporary, _) in &registry.unfinished {
        let _ = fs::remove_file(temporary);
    }
    // No thread may make another temporary file before the program has ended.
    std::mem::forget(registry);
}

/// An output that is being written. Dropped without [`NewFile::finish`], it leaves nothing.
#[derive(Debug)]
pub struct NewFile {
    /// As the user named it, for messages.
    name: PathBuf,
    /// Temporary name and final path; `None` for a pipe or a device, which is written as it is.
    rename: Option<(PathBuf, PathBuf)>,
    /// `None` once it is closed.
    file: Option<BufWriter<File>>,
}

impl NewFile {
    /// Starts an output. Missing folders are made; links are followed; pipes and devices are
    /// written directly.
    ///
    /// # Errors
    /// `Usage` for a folder, a protected input, or a path that another unfinished output has; `Io`
    /// where the file cannot be made.
    pub fn create(path: &Path) -> Result<NewFile> {
        let io = |source| Error::Io {
            path: path.to_owned(),
            source,
        };
        let refuse = |what: &str| Err(Error::Usage(format!("{}: {what}", path.display())));
        if path.as_os_str().is_empty() {
            return Err(Error::Usage("the name of an output is empty".into()));
        }
        let found = match fs::metadata(path) {
            Ok(metadata) => Some(metadata),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(io(error)),
        };
        let slash = path.as_os_str().as_encoded_bytes().ends_with(b"/");
        if slash || found.as_ref().is_some_and(fs::Metadata::is_dir) {
            return refuse("this is a folder; name a file");
        }
        let target = follow_links(path);
        let opened = |file, rename| NewFile {
            name: path.to_owned(),
            rename,
            file: Some(BufWriter::new(file)),
        };
        if found.as_ref().is_some_and(|m| !m.is_file()) || is_descriptor(&target) {
            let file = File::options().write(true).open(path).map_err(io)?;
            return Ok(opened(file, None));
        }
        let folder = match target.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        create_folder(folder)?;
        let mut registry = registry();
        if let Some(id) = FileId::of(&target)
            // As they are now: a removed file's inode may be that of another.
            && (registry.inputs.iter().filter_map(|path| FileId::of(path)))
                .any(|input| input.is_same_file(&id))
        {
            return refuse("this file is an input of the command; name another output");
        }
        // Two spellings of a path that is not there yet differ; its folder is there.
        let target = match (fs::canonicalize(folder), target.file_name()) {
            (Ok(folder), Some(name)) => folder.join(name),
            _ => return refuse("this does not name a file"),
        };
        if registry
            .unfinished
            .iter()
            .any(|(_, other)| *other == target)
        {
            return refuse("this file is named for two outputs");
        }
        let (temporary, file) = loop {
            registry.names += 1;
            let name = format!(".dapple-{}-{}.part", std::process::id(), registry.names);
            let temporary = target.with_file_name(name);
            match File::options()
                .write(true)
                .create_new(true)
                .open(&temporary)
            {
                Ok(file) => break (temporary, file),
                // Left by a process of the same number that was killed.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(io(error)),
            }
        };
        registry
            .unfinished
            .push((temporary.clone(), target.clone()));
        if let Some(old) = found {
            // Where it fails, the new file has the permissions of any new file.
            let _ = file.set_permissions(old.permissions());
        }
        Ok(opened(file, Some((temporary, target))))
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// `Io` where not all of it could be written; the old file stays then.
    pub fn finish(mut self) -> Result<()> {
        let io = |source| Error::Io {
            path: self.name.clone(),
            source,
        };
        let Some(mut file) = self.file.take() else {
            return Ok(());
        };
        file.flush().map_err(io)?;
        let Some((temporary, target)) = &self.rename else {
            return Ok(());
        };
        // Some file systems notice a full disk only here.
        file.get_ref().sync_all().map_err(io)?;
        drop(file);
        let mut registry = registry();
        fs::rename(temporary, target).map_err(io)?;
        registry.unfinished.retain(|(other, _)| other != temporary);
        drop(registry);
        self.rename = None;
        Ok(())
    }

    /// An error of writing to it.
    pub fn error(&self, source: io::Error) -> Error {
        Error::Io {
            path: self.name.clone(),
            source,
        }
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.file {
            Some(file) => file.write(bytes),
            None => Ok(0),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().map_or(Ok(()), BufWriter::flush)
    }
}

impl Drop for NewFile {
    fn drop(&mut self) {
        if let Some((temporary, _)) = self.rename.take() {
            self.file = None;
            let mut registry = registry();
            let _ = fs::remove_file(&temporary);
            registry.unfinished.retain(|(other, _)| *other != temporary);
        }
    }
}

/// Writes a whole file.
///
/// # Errors
/// As [`NewFile::create`] and [`NewFile::finish`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = NewFile::create(path)?;
    file.write_all(bytes).map_err(|e| file.error(e))?;
    file.finish()
}

/// Makes a folder and those above it.
///
/// # Errors
/// `Io` where it cannot be made.
pub fn create_folder(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|source| Error::Io {
        path: path.to_owned(),
        source: match source.kind() {
            // What the system says of a file in the place of a folder is "File exists".
            io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory => io::Error::new(
                io::ErrorKind::NotADirectory,
                "a file stands where a folder is to be made; name another folder",
            ),
            _ => source,
        },
    })
}

/// Where the links at the end of a path lead, whether a file is there or not.
fn follow_links(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        match fs::read_link(&path) {
            Ok(to) if !is_descriptor(&path) => {
                path = path.parent().unwrap_or(Path::new("")).join(to);
            }
            _ => break,
        }
    }
    path
}

/// Whether the path stands for an open file, such as the one behind `/dev/stdout`.
fn is_descriptor(path: &Path) -> bool {
    cfg!(unix) && (path.starts_with("/proc") || path.starts_with("/dev/fd"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        let mut names: Vec<String> = entries
            .map(|e| {
                e.expect("an entry")
                    .file_name()
                    .into_string()
                    .expect("UTF-8")
            })
            .collect();
        names.sort();
        names
    }

    #[test]
    fn files_appear_whole_or_not_at_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("below/it/a.txt");
        write(&path, b"old").expect("written");
        let mut file = NewFile::create(&path).expect("created");
        file.write_all(b"half").expect("written");
        file.flush().expect("flushed");
        assert_eq!(fs::read(&path).expect("read"), b"old");
        drop(file);
        assert_eq!(names(&folder.path().join("below/it")), ["a.txt"]);
        let mut file = NewFile::create(&path).expect("created");
        file.write_all(b"new").expect("written");
        file.finish().expect("finished");
        assert_eq!(fs::read(&path).expect("read"), b"new");
        assert_eq!(names(&folder.path().join("below/it")), ["a.txt"]);
    }

    #[test]
    fn an_output_has_one_writer() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        let first = NewFile::create(&path).expect("created");
        let again = folder.path().join("./a.txt");
        assert!(matches!(NewFile::create(&again), Err(Error::Usage(_))));
        first.finish().expect("finished");
        NewFile::create(&again).expect("created");
    }

    #[test]
    fn folders_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let error = NewFile::create(folder.path()).expect_err("a folder");
        assert!(matches!(error, Error::Usage(_)), "{error}");
        for name in ["", "new/"] {
            let refused = NewFile::create(Path::new(name));
            assert!(matches!(refused, Err(Error::Usage(_))), "{name}");
        }
        fs::write(folder.path().join("file"), b"").expect("written");
        let below = NewFile::create(&folder.path().join("file/a.txt"));
        assert!(matches!(below, Err(Error::Io { .. })));
    }

    #[cfg(unix)]
    mod unix {
        use super::*;
        use std::os::unix::fs::{PermissionsExt, symlink};

        #[test]
        fn inputs_are_protected_under_all_their_names() {
            let folder = tempfile::tempdir().expect("a folder");
            let at = |name: &str| folder.path().join(name);
            fs::write(at("in"), b"input").expect("written");
            symlink("in", at("soft")).expect("a link");
            fs::hard_link(at("in"), at("hard")).expect("a link");
            symlink(folder.path(), at("folder")).expect("a link");
            protect(&at("soft"));
            for name in ["in", "soft", "hard", "folder/in"] {
                let error = NewFile::create(&at(name)).expect_err(name);
                assert!(matches!(error, Error::Usage(_)), "{name}: {error}");
            }
            write(&at("out"), b"output").expect("written");
            assert_eq!(fs::read(at("in")).expect("read"), b"input");
        }

        #[test]
        fn links_and_permissions_stay() {
            let folder = tempfile::tempdir().expect("a folder");
            let at = |name: &str| folder.path().join(name);
            symlink("real", at("link")).expect("a link");
            // A link to nothing names the file that is made.
            write(&at("link"), b"one").expect("written");
            assert_eq!(fs::read(at("real")).expect("read"), b"one");
            fs::set_permissions(at("real"), fs::Permissions::from_mode(0o600)).expect("set");
            write(&at("link"), b"two").expect("written");
            assert!(fs::read_link(at("link")).is_ok());
            let mode = fs::metadata(at("real"))
                .expect("a file")
                .permissions()
                .mode();
            assert_eq!(mode & 0o777, 0o600);
            assert_eq!(fs::read(at("real")).expect("read"), b"two");
        }

        #[test]
        fn devices_are_written_and_a_full_one_is_an_error() {
            write(Path::new("/dev/null"), b"gone").expect("written");
            if Path::new("/dev/full").exists() {
                assert!(matches!(
                    write(Path::new("/dev/full"), b"gone"),
                    Err(Error::Io { .. })
                ));
            }
        }
    }
}
