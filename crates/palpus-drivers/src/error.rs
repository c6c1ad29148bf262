//! Errors of the makers' libraries.

use std::path::PathBuf;

/// Why no device could be opened through a maker's library. The text says what is wrong and how to
/// fix it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DriverError {
    /// The library was not found.
    #[error("the library was not found (searched for {looked_for}); {mend}")]
    LibraryMissing {
        /// The file names and the folders that were searched.
        looked_for: String,
        /// How to fix the problem, in one line.
        mend: String,
    },
    /// The file exists, but the system cannot load it.
    #[error("{} cannot be loaded: {why}; {mend}", path.display())]
    LibraryBroken {
        /// The file.
        path: PathBuf,
        /// The reason that the system gives.
        why: String,
        /// How to fix the problem, in one line.
        mend: String,
    },
    /// The library lacks a function.
    #[error("{} has no function `{symbol}`: it is the wrong library or too old; {mend}", path.display())]
    SymbolMissing {
        /// The file.
        path: PathBuf,
        /// The function's name.
        symbol: &'static str,
        /// How to fix the problem, in one line.
        mend: String,
    },
    /// The library was loaded but finds no usable device.
    #[error("{why}; {mend}")]
    NoDevice {
        /// Message of the library.
        why: String,
        /// How to fix the problem, in one line.
        mend: String,
    },
}

impl DriverError {
    /// Returns the problem, without how to fix it.
    pub fn why(&self) -> String {
        let all = self.to_string();
        all.strip_suffix(self.mend()).map_or(all.clone(), |why| why.trim_end_matches("; ").to_owned())
    }

    /// Returns how to fix the problem, in one line.
    pub fn mend(&self) -> &str {
        match self {
            Self::LibraryMissing { mend, .. }
            | Self::LibraryBroken { mend, .. }
            | Self::SymbolMissing { mend, .. }
            | Self::NoDevice { mend, .. } => mend,
        }
    }
}
