//! Names of the files and folders that the program makes, and errors that name them.

use std::fmt::Display;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, bail};
use etcetera::BaseStrategy;
use palpus::algebra::Pose;
use palpus_io::query::read_poses_from;

/// Returns `base`, or if that file exists, the first free name of `base-2`, `base-3`, ….
pub(crate) fn free(base: &Path) -> PathBuf {
    first_free(base, |path| !path.exists())
}

/// Returns the first of the names `base`, `base-2`, `base-3`, … for which `is_free` is true.
pub(crate) fn first_free(base: &Path, is_free: impl Fn(&Path) -> bool) -> PathBuf {
    let numbered = (2u32..).map(|k| beside(base, k));
    std::iter::once(base.to_owned()).chain(numbered).find(|path| is_free(path)).unwrap_or_else(|| base.to_owned())
}

/// Returns the path with `-addition` before the ending of the file name.
pub(crate) fn beside(base: &Path, addition: impl Display) -> PathBuf {
    let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let (stem, extension) = (part(base.file_stem()), part(base.extension()));
    let dot = if extension.is_empty() { "" } else { "." };
    base.with_file_name(format!("{stem}-{addition}{dot}{extension}"))
}

/// The file name that means standard input or output.
const STANDARD: &str = "-";
/// Largest size of the data from standard input, bytes.
const MOST_INPUT: u64 = 1 << 33;

/// Returns true for the file name `-`, which means standard input or output.
pub(crate) fn is_standard(file: &Path) -> bool {
    file == Path::new(STANDARD)
}

/// Returns the name of an input file for messages.
pub(crate) fn input_name(file: &Path) -> String {
    if is_standard(file) { "standard input".to_owned() } else { file.display().to_string() }
}

/// Reads standard input to its end. Fails if it was read before, because one stream cannot be two
/// files.
pub(crate) fn read_standard() -> anyhow::Result<Vec<u8>> {
    static IS_READ: AtomicBool = AtomicBool::new(false);
    if IS_READ.swap(true, Ordering::Relaxed) {
        bail!("`-` stands for standard input, which has the data of one file; name the other file");
    }
    let mut bytes = Vec::new();
    std::io::stdin().take(MOST_INPUT).read_to_end(&mut bytes).context("standard input cannot be read")?;
    Ok(bytes)
}

/// Reads a list of poses from a file, or from standard input for `-`.
pub(crate) fn read_poses(file: &Path) -> anyhow::Result<Vec<Pose>> {
    if !is_standard(file) {
        return Ok(palpus_io::read_poses(file)?);
    }
    Ok(read_poses_from(&read_standard()?, &input_name(file))?)
}

/// Creates a folder and its parents, if they do not exist.
pub(crate) fn make_folder(folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("{} could not be created", folder.display()))
}

/// Creates the folder of `file`.
pub(crate) fn make_folder_of(file: &Path) -> anyhow::Result<()> {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).map_or(Ok(()), make_folder)
}

/// Returns the path of a file that the program stores for its user; `None` without a home folder.
pub(crate) fn of_user(name: &str) -> Option<PathBuf> {
    let base = etcetera::choose_base_strategy().ok()?;
    Some(base.state_dir().unwrap_or_else(|| base.data_dir()).join("palpus").join(name))
}

/// Writes a whole file, and replaces an existing file.
pub(crate) fn write(file: &Path, content: impl AsRef<[u8]>) -> anyhow::Result<()> {
    fs::write(file, content).with_context(|| format!("{} could not be written", file.display()))
}
