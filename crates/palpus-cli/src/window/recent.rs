//! Recently opened files of the window, stored between runs in the user's folder.
//!
//! A list that cannot be read is treated as empty, and write errors are ignored.

use std::fs;
use std::path::{Path, PathBuf};

use crate::files;

/// Capacity of the list.
const MOST: usize = 8;
/// Largest list that is read, bytes.
const LONGEST: u64 = 1 << 16;

/// The list, newest first.
pub(super) struct Recent {
    files: Vec<PathBuf>,
    kept_in: Option<PathBuf>,
}

impl Recent {
    /// Returns the user's list.
    pub(super) fn of_user() -> Self {
        Self::kept_in(files::of_user("recent.txt"))
    }

    /// Returns the list in a file, if there is one.
    pub(super) fn kept_in(file: Option<PathBuf>) -> Self {
        let is_small = |file: &PathBuf| fs::metadata(file).is_ok_and(|data| data.len() <= LONGEST);
        let text = file.clone().filter(is_small).and_then(|file| fs::read_to_string(file).ok()).unwrap_or_default();
        Self { files: text.lines().take(MOST).map(PathBuf::from).collect(), kept_in: file }
    }

    /// Returns the files that still exist.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.files.iter().filter(|file| file.is_file()).cloned().collect()
    }

    /// Puts `file` at the top of the list.
    pub(super) fn add(&mut self, file: &Path) {
        let Ok(file) = std::path::absolute(file) else { return };
        self.files.retain(|other| *other != file);
        self.files.insert(0, file);
        self.files.truncate(MOST);
        let Some(kept_in) = &self.kept_in else { return };
        // A name with a line break would become two entries.
        let lines = self.files.iter().filter_map(|file| file.to_str()).filter(|name| !name.contains('\n'));
        let text: String = lines.flat_map(|name| [name, "\n"]).collect();
        let written = kept_in.parent().map(fs::create_dir_all).map(|_| fs::write(kept_in, text));
        drop(written);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recent_files_come_back_newest_first() {
        let folder = std::env::temp_dir().join(format!("palpus-recent-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("the folder can be created");
        let list = folder.join("state/recent.txt");
        let files: Vec<PathBuf> = (0..MOST + 2).map(|k| folder.join(format!("{k}.obj"))).collect();
        let mut recent = Recent::kept_in(Some(list.clone()));
        for file in &files {
            fs::write(file, "").expect("the file can be written");
            recent.add(file);
        }
        recent.add(&files[5]);
        let again = Recent::kept_in(Some(list)).files();
        assert_eq!((again.len(), &again[0], &again[1]), (MOST, &files[5], &files[MOST + 1]));
        fs::remove_file(&files[5]).expect("the file can be deleted");
        assert_eq!(recent.files()[0], files[MOST + 1], "a missing file must not be offered");
        let _ = fs::remove_dir_all(&folder);
    }
}
