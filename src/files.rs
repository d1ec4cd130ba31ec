//! Files written whole or not at all.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// Writes a file whole or not at all, whoever else may be writing it; through a link, to what it stands for. A device
/// or a pipe is no file to replace: it is given the text.
pub fn write(file: &Path, text: &str) -> io::Result<()> {
    let target = target(file)?;
    if is_device(&target) {
        return OpenOptions::new().write(true).open(&target)?.write_all(text.as_bytes());
    }
    let mut part = part(&target)?;
    part.write_all(text.as_bytes())?;
    // The name is to be taken by a file that is on the disk.
    part.as_file().sync_all()?;
    // What cannot be renamed is taken away again.
    part.persist(&target).map(|_: File| ()).map_err(|error| error.error)
}

/// Whether a file could be written, as far as can be told without doing it.
pub fn check(file: &Path) -> io::Result<()> {
    let target = target(file)?;
    if is_device(&target) { Ok(()) } else { part(&target).map(|_| ()) }
}

/// Where a file is or would be: its folder without links and detours, and its name.
pub fn place(file: &Path) -> Option<PathBuf> {
    Some(folder(file).canonicalize().ok()?.join(file.file_name()?))
}

/// What is meant by a name: what it links to, or itself.
fn target(file: &Path) -> io::Result<PathBuf> {
    let text = file.to_string_lossy();
    if file.file_name().is_none() || text.ends_with(['/', std::path::MAIN_SEPARATOR]) || text.ends_with("/.") {
        return Err(io::Error::other("expected the name of a file"));
    }
    match file.canonicalize() {
        Ok(target) if target.is_dir() => Err(io::Error::other("is a folder, expected a file")),
        Ok(target) if is_output(&target) => Err(io::Error::other("is what is printed to, expected another file")),
        Ok(target) => Ok(target),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            // A link to what is not there yet. (Links that lead back to themselves are another error.)
            if let Ok(linked) = file.read_link() {
                return target(&folder(file).join(linked));
            }
            let folder = folder(file);
            if folder.is_dir() {
                Ok(file.to_owned())
            } else {
                Err(io::Error::other(format!("there is no folder {}", folder.display())))
            }
        }
        Err(error) => Err(error),
    }
}

/// Whether it is the file that the program prints to: the one would write over the other.
#[cfg(unix)]
fn is_output(target: &Path) -> bool {
    use std::os::fd::AsFd;
    use std::os::unix::fs::MetadataExt;
    let output = io::stdout().as_fd().try_clone_to_owned().and_then(|output| File::from(output).metadata());
    let is_same = |(a, b): (std::fs::Metadata, std::fs::Metadata)| (a.dev(), a.ino()) == (b.dev(), b.ino());
    target.is_file() && output.ok().zip(target.metadata().ok()).is_some_and(is_same)
}

#[cfg(not(unix))]
fn is_output(_target: &Path) -> bool {
    false
}

fn is_device(target: &Path) -> bool {
    target.metadata().is_ok_and(|data| !data.is_file())
}

fn folder(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A file beside it under a name that nobody else has, which is gone unless it takes the place of another.
fn part(target: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".ape-").suffix(".part");
    // As any new file, not for its owner alone.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let part = builder.tempfile_in(folder(target))?;
    // Or as the one whose place it takes.
    #[cfg(unix)]
    if let Ok(before) = target.metadata() {
        part.as_file().set_permissions(before.permissions())?;
    }
    Ok(part)
}
