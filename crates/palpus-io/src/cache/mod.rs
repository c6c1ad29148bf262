//! Prepared bodies on disk, so that a model is decomposed once.
//!
//! * A body's name is the hash of the mesh's content, the settings, the engine's sources and this format: what was
//!   prepared from anything else has another name and is never asked for.
//! * A file holds its own name and the hash of all that follows, so that a file that was cut, changed or renamed is
//!   known as such. It is written beside its place and then moved there: nobody meets a half-written one.
//! * What a file says is believed only as far as it is checked: counts against the bytes that are left, indices against
//!   counts, polytopes against their own topology ([`Body::restore`]). Any bytes give a body or a [`CacheMiss`].
//! * The folder holds at most [`LARGEST_FOLDER`] bytes of bodies; those not used for longest go first.

mod bytes;
mod parts;

use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use etcetera::BaseStrategy;
use palpus::algebra::{Workers, both};
use palpus::body::{Body, BodySettings, Ground, PolygonSoup};

use crate::ContentHash;

/// Raised when the layout of a file changes.
const FORMAT: u32 = 1;
const MAGIC: &[u8; 8] = b"palpus b";
/// Magic, name, length of what follows and its hash.
const HEADER_BYTES: usize = 8 + 32 + 8 + 32;
/// The largest file that is read or written.
const LARGEST_FILE: u64 = 1 << 32;
/// The most that all files together take.
pub const LARGEST_FOLDER: u64 = 1 << 32;
const EXTENSION: &str = "body";

/// What a prepared body is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BodyKey(ContentHash);

impl BodyKey {
    /// The name of the body that this engine makes of this content with these settings.
    pub fn new(content: &ContentHash, settings: &BodySettings) -> Self {
        // Taken apart, so that a new setting cannot be forgotten here.
        let BodySettings { scale, flatness, thick } = *settings;
        let mut text = Vec::new();
        text.extend(b"palpus body");
        text.extend(FORMAT.to_le_bytes());
        text.extend(Body::FINGERPRINT.as_bytes());
        text.extend(content.0);
        text.extend(scale.to_le_bytes());
        text.extend(flatness.to_le_bytes());
        text.push(u8::from(thick));
        Self(ContentHash::of_bytes(&text))
    }
}

/// Why there is no prepared body to be had.
#[derive(Debug, thiserror::Error)]
pub enum CacheMiss {
    /// None was kept.
    #[error("not prepared before")]
    Absent,
    /// The file cannot be read.
    #[error("{file} cannot be read: {source}")]
    Unreadable {
        /// Where it is.
        file: String,
        /// What the system says.
        #[source]
        source: io::Error,
    },
    /// The file is not what was written.
    #[error("{file} is damaged: {what}")]
    Damaged {
        /// Where it is.
        file: String,
        /// What is wrong.
        what: String,
    },
}

/// A folder of prepared bodies.
#[derive(Clone, Debug)]
pub struct BodyCache {
    folder: PathBuf,
}

impl BodyCache {
    /// In this folder, which is made when first needed.
    pub fn in_folder(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// In the user's folder for what can be computed again (`XDG_CACHE_HOME` or what the system has for it); `None` when
    /// there is no such user.
    pub fn of_user() -> Option<Self> {
        let base = etcetera::choose_base_strategy().ok()?;
        Some(Self::in_folder(base.cache_dir().join("palpus").join("bodies")))
    }

    /// Where the bodies lie.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The body that was kept under `key`, which must be that of `soup` and `settings`.
    pub fn load(
        &self,
        key: &BodyKey,
        soup: &PolygonSoup,
        settings: &BodySettings,
        workers: &dyn Workers,
    ) -> Result<Body, CacheMiss> {
        let path = self.path(key);
        let file = path.display().to_string();
        let damaged = |what: String| CacheMiss::Damaged { file: file.clone(), what };
        let missed = |error: io::Error| match error.kind() {
            io::ErrorKind::NotFound => CacheMiss::Absent,
            _ => CacheMiss::Unreadable { file: file.clone(), source: error },
        };
        let kept = Kept::open(&path, key).map_err(missed)?.map_err(|what| damaged(what.to_owned()))?;
        let ground = || Ground::new(soup, settings).map_err(|error| damaged(error.to_string()));
        let parts = || {
            let payload = kept.payload().map_err(missed)?.map_err(|what| damaged(what.to_owned()))?;
            parts::decode(&payload, workers).ok_or_else(|| damaged("its contents make no body".to_owned()))
        };
        let (parts, ground) = both(workers, parts, ground);
        let body = Body::restore(ground?, parts?, workers).map_err(|error| damaged(error.to_string()))?;
        // Says when it was last used; of a folder that cannot be written to, nothing goes anyway.
        let _ = File::options().append(true).open(&path).and_then(|file| file.set_modified(SystemTime::now()));
        Ok(body)
    }

    /// Keeps a body under `key`.
    pub fn store(&self, key: &BodyKey, body: &Body) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let path = self.path(key);
        let temporary = path.with_extension(format!("{}.tmp", std::process::id()));
        let written = write(&temporary, key, body).and_then(|()| fs::rename(&temporary, &path));
        if written.is_err() {
            let _ = fs::remove_file(&temporary);
        }
        written?;
        self.prune(LARGEST_FOLDER, &path)
    }

    fn path(&self, key: &BodyKey) -> PathBuf {
        self.folder.join(format!("{}.{EXTENSION}", key.0))
    }

    /// Removes the bodies not used for longest until all take at most `most` bytes; never `kept`.
    fn prune(&self, most: u64, kept: &Path) -> io::Result<()> {
        let mut bodies = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let entry = entry?;
            let path = entry.path();
            if path.extension().is_some_and(|extension| extension == EXTENSION) {
                let about = entry.metadata()?;
                bodies.push((about.modified()?, about.len(), path));
            }
        }
        bodies.sort();
        let mut total: u64 = bodies.iter().map(|(_, bytes, _)| bytes).sum();
        for (_, bytes, path) in bodies {
            if total > most && path != kept {
                // Another process may have been faster.
                let _ = fs::remove_file(path);
                total -= bytes;
            }
        }
        Ok(())
    }
}

/// Writes the file; its header last, when length and hash are known.
fn write(path: &Path, key: &BodyKey, body: &Body) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(&[0; HEADER_BYTES])?;
    let (mut length, mut hasher) = (0, blake3::Hasher::new());
    parts::encode(body, &mut |bytes| {
        length += bytes.len() as u64;
        if length > LARGEST_FILE {
            return Err(io::Error::other("the body is too large to be kept"));
        }
        hasher.update(bytes);
        file.write_all(bytes)
    })?;
    file.rewind()?;
    file.write_all(MAGIC)?;
    file.write_all(&key.0.0)?;
    file.write_all(&length.to_le_bytes())?;
    file.write_all(hasher.finalize().as_bytes())?;
    file.flush()
}

/// A file whose header is right.
struct Kept {
    file: File,
    length: u64,
    hash: [u8; 32],
}

impl Kept {
    /// The file, or what is wrong with its header.
    fn open(path: &Path, key: &BodyKey) -> io::Result<Result<Self, &'static str>> {
        let mut file = File::open(path)?;
        let size = file.metadata()?.len();
        let mut header = [0; HEADER_BYTES];
        match file.read_exact(&mut header) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(Err("it is cut short")),
            read => read?,
        }
        let (magic, rest) = header.split_at(8);
        let (name, rest) = rest.split_at(32);
        let (length, expected) = rest.split_at(8);
        let length = length.iter().rev().fold(0, |length, &byte| length << 8 | u64::from(byte));
        if magic != MAGIC || name != key.0.0 {
            return Ok(Err("it is not what its name says"));
        }
        if length > LARGEST_FILE || size != HEADER_BYTES as u64 + length {
            return Ok(Err("it is cut short"));
        }
        let mut hash = [0; 32];
        hash.copy_from_slice(expected);
        Ok(Ok(Self { file, length, hash }))
    }

    /// What follows the header, or what is wrong with it; to be asked for once.
    fn payload(&self) -> io::Result<Result<Vec<u8>, &'static str>> {
        let mut payload = Vec::with_capacity(self.length as usize);
        (&self.file).take(self.length).read_to_end(&mut payload)?;
        Ok(if *blake3::hash(&payload).as_bytes() == self.hash { Ok(payload) } else { Err("its hash is wrong") })
    }
}

#[cfg(test)]
mod tests;
