//! Why a maker's library does not give a device.

use std::path::PathBuf;

/// Why a maker's library does not give a device. Displayed, it says what is wrong and what mends
/// it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DriverError {
    /// There is no library.
    #[error("the library is missing (looked for {looked_for}); {mend}")]
    LibraryMissing {
        /// Which files, where.
        looked_for: String,
        /// Advice, in one line.
        mend: String,
    },
    /// There is a file, but the system cannot load it.
    #[error("{} cannot be loaded: {why}; {mend}", path.display())]
    LibraryBroken {
        /// The file.
        path: PathBuf,
        /// As the system says.
        why: String,
        /// Advice, in one line.
        mend: String,
    },
    /// The library lacks a function.
    #[error("{} has no function `{symbol}`: it is another library, or too old; {mend}", path.display())]
    SymbolMissing {
        /// The file.
        path: PathBuf,
        /// The function's name.
        symbol: &'static str,
        /// Advice, in one line.
        mend: String,
    },
    /// The library was loaded but finds no usable device.
    #[error("{why}; {mend}")]
    NoDevice {
        /// Message of the library.
        why: String,
        /// Advice, in one line.
        mend: String,
    },
}

impl DriverError {
    /// The problem, without advice.
    pub fn why(&self) -> String {
        let all = self.to_string();
        all.strip_suffix(self.mend()).map_or(all.clone(), |why| why.trim_end_matches("; ").to_owned())
    }

    /// Advice, in one line.
    pub fn mend(&self) -> &str {
        match self {
            Self::LibraryMissing { mend, .. }
            | Self::LibraryBroken { mend, .. }
            | Self::SymbolMissing { mend, .. }
            | Self::NoDevice { mend, .. } => mend,
        }
    }
}
