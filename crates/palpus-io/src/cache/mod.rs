//! Prepared bodies on disk, so that each model is decomposed only once.
//!
//! * The name of a body is the hash of the mesh's content, the settings, the engine's sources and
//!   the file format. If one of these inputs changes, the name changes.
//! * A file contains its name, the batches, and an index with the length and hash of each batch.
//!   The header contains a hash of the index, so truncated, changed and renamed files are detected.
//!   All workers read batches, check them and build their polytopes at the same time; the whole
//!   file is never in memory. A file is written under a temporary name and then renamed, so that no
//!   reader sees an incomplete file.
//! * All content is checked: counts against the number of remaining bytes, indices against counts,
//!   polytopes while they are built (`PolytopeRestorer`), and the whole body in [`Body::restore`].
//!   Any sequence of bytes gives either a valid body or a [`CacheMiss`].
//! * The folder contains at most [`LARGEST_FOLDER`] bytes of bodies. The least recently used bodies
//!   are deleted first.

mod bytes;
mod parts;

use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

use etcetera::BaseStrategy;
use palpus::algebra::{Workers, both};
use palpus::body::{Body, BodyError, BodySettings, Ground, PolygonSoup};

use crate::ContentHash;

/// Version of the file layout. Increase it with each change of the layout.
const FORMAT: u32 = 2;
/// The first bytes of every file.
const MAGIC: &[u8; 8] = b"palpus b";
/// Size of the header: magic number, name, length of the index, and hash of the index.
const HEADER_BYTES: usize = 8 + 32 + 8 + 32;
/// Size of the index entry of a batch: the length of the batch and its hash.
const ENTRY_BYTES: usize = 8 + 32;
/// Size of the largest file that is read or written, in bytes.
const LARGEST_FILE: u64 = 1 << 32;
/// Largest total size of all files in the folder, in bytes.
pub const LARGEST_FOLDER: u64 = 1 << 32;
/// Extension of the file names.
const EXTENSION: &str = "body";

/// Name of a prepared body in the cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BodyKey(ContentHash);

impl BodyKey {
    /// Returns the name of the body that this engine computes from this content with these
    /// settings.
    pub fn new(content: &ContentHash, settings: &BodySettings) -> Self {
        // Destructuring makes the compiler report a new setting that is missing here.
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

/// The reason why a prepared body is not available.
#[derive(Debug, thiserror::Error)]
pub enum CacheMiss {
    /// The cache has no body of this name.
    #[error("not prepared before")]
    Absent,
    /// The file cannot be read.
    #[error("{file} cannot be read: {source}")]
    Unreadable {
        /// Path of the file.
        file: String,
        /// Error of the operating system.
        #[source]
        source: io::Error,
    },
    /// The file's content is invalid.
    #[error("{file} is damaged: {what}")]
    Damaged {
        /// Path of the file.
        file: String,
        /// Reason.
        what: String,
    },
}

/// A folder of prepared bodies.
#[derive(Clone, Debug)]
pub struct BodyCache {
    folder: PathBuf,
}

/// Returns the body of `soup`, either from `cache` or newly prepared; a new body is then stored in
/// `cache`. `progress` receives the completed fraction, 0 to 1.
///
/// # Errors
/// Fails if the polygons do not form a valid body.
pub fn prepared(
    soup: &PolygonSoup,
    settings: &BodySettings,
    cache: Option<&BodyCache>,
    workers: &dyn Workers,
    progress: &mut dyn FnMut(f64),
) -> Result<Body, BodyError> {
    let Some(cache) = cache else { return Body::from_soup_with(soup, settings, workers, progress) };
    let key = BodyKey::new(&ContentHash::of_soup(soup), settings);
    if let Ok(body) = cache.load(&key, soup, settings, workers) {
        return Ok(body);
    }
    let body = Body::from_soup_with(soup, settings, workers, progress)?;
    // Errors are ignored: if the folder is not writable, the body is only prepared again next time.
    let _ = cache.store(&key, &body);
    Ok(body)
}

impl BodyCache {
    /// Uses the given folder, which is created when the first body is stored.
    pub fn in_folder(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// Uses the cache folder of the current user (`XDG_CACHE_HOME` or the equivalent of the
    /// operating system); `None` if the user has no home directory.
    pub fn of_user() -> Option<Self> {
        let base = etcetera::choose_base_strategy().ok()?;
        Some(Self::in_folder(base.cache_dir().join("palpus").join("bodies")))
    }

    /// Returns the folder of the bodies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Loads the body stored under `key`, which must be the name of the body of `soup` and
    /// `settings`.
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
        let with_batch = |k: usize, read: &mut dyn FnMut(&[u8])| {
            kept.with_batch(k, read).map_err(missed)?.map_err(|what| damaged(what.to_owned()))
        };
        let parts = || {
            let parts = parts::decode(kept.batches.len(), with_batch, workers)?;
            parts.ok_or_else(|| damaged("its content is not a valid body".to_owned()))
        };
        let (parts, ground) = both(workers, parts, ground);
        let body = Body::restore(ground?, parts?, workers).map_err(|error| damaged(error.to_string()))?;
        // Updates the time of last use. Errors are ignored, because nothing is deleted from a
        // read-only folder.
        let _ = File::options().append(true).open(&path).and_then(|file| file.set_modified(SystemTime::now()));
        Ok(body)
    }

    /// Stores a body under `key`.
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

    /// Deletes the least recently used bodies until the folder contains at most `most` bytes; never
    /// deletes `kept`.
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
                // The error is ignored, because another process may have deleted the file already.
                let _ = fs::remove_file(path);
                total -= bytes;
            }
        }
        Ok(())
    }
}

/// Writes the file: space for the header, the batches, and the index of the batches. The header is
/// written last, when the index is known.
fn write(path: &Path, key: &BodyKey, body: &Body) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(&[0; HEADER_BYTES])?;
    let (mut length, mut index) = (0, Vec::new());
    parts::encode(body, &mut |batch| {
        length += (batch.len() + ENTRY_BYTES) as u64;
        if length > LARGEST_FILE {
            return Err(io::Error::other("the body is too large for the cache"));
        }
        index.extend((batch.len() as u64).to_le_bytes());
        index.extend(blake3::hash(batch).as_bytes());
        file.write_all(batch)
    })?;
    file.write_all(&index)?;
    file.rewind()?;
    file.write_all(MAGIC)?;
    file.write_all(&key.0.0)?;
    file.write_all(&(index.len() as u64).to_le_bytes())?;
    file.write_all(blake3::hash(&index).as_bytes())?;
    file.flush()
}

/// A file whose header and index are valid.
struct Kept {
    file: Mutex<File>,
    batches: Vec<Entry>,
    /// Buffers for batches. The buffers are reused, because allocating a buffer takes longer than
    /// reading a batch.
    spare: Mutex<Vec<Vec<u8>>>,
}

/// A batch, as described by the index.
struct Entry {
    begin: u64,
    length: usize,
    hash: [u8; 32],
}

impl Kept {
    /// Opens the file; the inner error describes a defect of the header or the index.
    fn open(path: &Path, key: &BodyKey) -> io::Result<Result<Self, &'static str>> {
        let mut file = File::open(path)?;
        let size = file.metadata()?.len();
        let mut header = [0; HEADER_BYTES];
        match file.read_exact(&mut header) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Ok(Err("it is truncated")),
            read => read?,
        }
        let (magic, rest) = header.split_at(8);
        let (name, rest) = rest.split_at(32);
        let (length, expected) = rest.split_at(8);
        if magic != MAGIC || name != key.0.0 {
            return Ok(Err("its header does not match its name"));
        }
        let length = little_endian(length);
        if size > LARGEST_FILE || length > size - HEADER_BYTES as u64 {
            return Ok(Err("it is truncated"));
        }
        let mut index = Vec::with_capacity(length as usize);
        file.seek(io::SeekFrom::Start(size - length))?;
        (&file).take(length).read_to_end(&mut index)?;
        if blake3::hash(&index) != *expected {
            return Ok(Err("its hash is wrong"));
        }
        let mut begin = HEADER_BYTES as u64;
        let mut batches = Vec::with_capacity(index.len() / ENTRY_BYTES);
        for entry in index.as_chunks::<ENTRY_BYTES>().0 {
            let (length, expected) = entry.split_at(8);
            let length = little_endian(length);
            if length > size - begin {
                return Ok(Err("it is truncated"));
            }
            let mut hash = [0; 32];
            hash.copy_from_slice(expected);
            batches.push(Entry { begin, length: length as usize, hash });
            begin += length;
        }
        if begin + length != size {
            return Ok(Err("it is truncated"));
        }
        Ok(Ok(Self { file: Mutex::new(file), batches, spare: Mutex::default() }))
    }

    /// Passes the bytes of batch `k` to `read`; the inner error says that their hash is wrong.
    fn with_batch(&self, k: usize, read: &mut dyn FnMut(&[u8])) -> io::Result<Result<(), &'static str>> {
        let Entry { begin, length, hash } = self.batches[k];
        let mut bytes = held(&self.spare).pop().unwrap_or_default();
        bytes.clear();
        {
            let mut file = held(&self.file);
            file.seek(io::SeekFrom::Start(begin))?;
            (&mut *file).take(length as u64).read_to_end(&mut bytes)?;
        }
        let right = *blake3::hash(&bytes).as_bytes() == hash;
        if right {
            read(&bytes);
        }
        held(&self.spare).push(bytes);
        Ok(if right { Ok(()) } else { Err("its hash is wrong") })
    }
}

fn little_endian(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
}

/// Locks the mutex. A panic of an earlier holder is ignored, since a panic cannot leave this data
/// half changed.
fn held<T>(lock: &Mutex<T>) -> MutexGuard<'_, T> {
    lock.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
