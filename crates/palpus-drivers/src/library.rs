//! Search for a maker's library.
//!
//! 1. If the user names a file, only that file is tried.
//! 2. Otherwise the system's loader searches for the usual names (`LD_LIBRARY_PATH`,
//!    `/etc/ld.so.conf`, `PATH`).
//! 3. Then the folders are searched that the makers' guides use for installation. There, a name may
//!    be followed by a version, because an unpacked kit does not have the plain names.

use std::path::{Path, PathBuf};

use crate::error::DriverError;
use crate::ffi::{self, Loaded};

/// Location of a library.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// Search in the usual folders.
    #[default]
    Usual,
    /// Use this file. The file can also be the maker's simulator, or a stand-in.
    File(PathBuf),
}

/// Names and folders of a library.
pub(crate) struct Known {
    /// File names of the library, in order of preference.
    pub(crate) names: &'static [&'static str],
    /// An environment variable with the path of the unpacked kit, and the kit's subfolders with
    /// libraries.
    pub(crate) kit: (&'static str, &'static [&'static str]),
    /// Advice if the library is not found.
    pub(crate) mend: &'static str,
}

/// Folders for libraries that are installed by hand.
#[cfg(unix)]
const FOLDERS: [&str; 5] =
    ["/usr/local/lib", "/usr/lib", "/usr/lib64", "/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu"];
#[cfg(not(unix))]
const FOLDERS: [&str; 0] = [];

impl Known {
    /// Loads the library.
    ///
    /// # Errors
    /// Fails if the library is not found, or cannot be loaded.
    pub(crate) fn open(&self, place: &Place) -> Result<Loaded, DriverError> {
        match place {
            Place::File(path) => self.open_file(path),
            Place::Usual => self.open_usual(),
        }
    }

    fn open_file(&self, path: &Path) -> Result<Loaded, DriverError> {
        if !path.exists() {
            let looked_for = path.display().to_string();
            return Err(DriverError::LibraryMissing {
                looked_for,
                mend: "give the path of the library file".to_owned(),
            });
        }
        // The loader would search its own folders for a bare name. An absolute path avoids this
        // search.
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        ffi::load(&absolute).map_err(|why| self.broken(path, why))
    }

    fn open_usual(&self) -> Result<Loaded, DriverError> {
        let mut broken = None;
        for name in self.names {
            match ffi::load(Path::new(name)) {
                Ok(loaded) => return Ok(loaded),
                // The error names the file that was not found. If the error names another file, a
                // dependency of this library is missing.
                Err(why) if cfg!(unix) && !why.contains(name) => {
                    broken = broken.or(Some(self.broken(Path::new(name), why)));
                }
                Err(_) => {}
            }
        }
        for path in self.files() {
            match ffi::load(&path) {
                Ok(loaded) => return Ok(loaded),
                Err(why) => broken = broken.or(Some(self.broken(&path, why))),
            }
        }
        Err(broken.unwrap_or_else(|| DriverError::LibraryMissing {
            looked_for: self.looked_for(),
            mend: self.mend.to_owned(),
        }))
    }

    fn broken(&self, path: &Path, why: String) -> DriverError {
        let mend =
            "check with `ldd` that it is built for this processor and that its dependencies are installed".to_owned();
        DriverError::LibraryBroken { path: path.to_owned(), why, mend }
    }

    /// Returns a text with the names and the folders that are searched.
    pub(crate) fn looked_for(&self) -> String {
        let (variable, _) = self.kit;
        let kit = match std::env::var(variable) {
            Ok(folder) if !folder.is_empty() => format!("below {folder} ({variable})"),
            _ => format!("below ${variable}, which is not set"),
        };
        let folders = if FOLDERS.is_empty() { String::new() } else { format!(", in {}", FOLDERS[..3].join(", ")) };
        format!("{} on the loader's path{folders}, and {kit}", self.names.join(", "))
    }

    /// Returns all files in the usual folders with one of the names, plain names first.
    fn files(&self) -> Vec<PathBuf> {
        let (variable, below) = self.kit;
        let kit = std::env::var_os(variable).filter(|folder| !folder.is_empty()).map(PathBuf::from);
        let of_kit = kit.iter().flat_map(|kit| below.iter().flat_map(|below| folders_like(&kit.join(below))));
        let folders: Vec<PathBuf> = of_kit.chain(FOLDERS.iter().map(PathBuf::from)).collect();
        folders.iter().flat_map(|folder| files_like(folder, self.names)).collect()
    }
}

/// Returns the folder. If its last part is `*`, returns all folders in its parent.
fn folders_like(folder: &Path) -> Vec<PathBuf> {
    if folder.file_name().is_none_or(|name| name != "*") {
        return vec![folder.to_owned()];
    }
    let Some(Ok(entries)) = folder.parent().map(std::fs::read_dir) else { return Vec::new() };
    let mut folders: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders
}

/// Returns the files in `folder` with one of the `names`, or with a version after such a name.
fn files_like(folder: &Path, names: &[&str]) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut found: Vec<(usize, PathBuf)> = Vec::new();
    for entry in entries.flatten() {
        let file = entry.file_name();
        let Some(file) = file.to_str() else { continue };
        let rank = names.iter().position(|name| {
            file.strip_prefix(name).is_some_and(|rest| rest.chars().all(|c| c == '.' || c.is_ascii_digit()))
        });
        if let Some(rank) = rank {
            found.push((rank, entry.path()));
        }
    }
    found.sort();
    found.into_iter().map(|(_, path)| path).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versioned_library_names_are_found() {
        let folder = std::env::temp_dir().join(format!("palpus-drivers-names-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for name in ["libdhd.so.3.17.6", "libdhd.so", "libdhd.a", "libdhd.so.txt", "libhd.so", "libdrd.so.3"] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        let names = |found: Vec<PathBuf>| -> Vec<String> {
            found.iter().filter_map(|path| Some(path.file_name()?.to_str()?.to_owned())).collect()
        };
        let found = names(files_like(&folder, &["libdhd.so", "libdrd.so"]));
        let everywhere = names(folders_like(&folder.join("*")));
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(found, ["libdhd.so", "libdhd.so.3.17.6", "libdrd.so.3"]);
        assert!(everywhere.is_empty());
    }
}
