//! Content hash of a mesh (32 bytes). Equal vertices and faces give equal hashes on every machine.

use std::fmt;
use std::str::FromStr;

use palpus::body::PolygonSoup;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Number of bytes that are hashed at once.
const CHUNK: usize = 1 << 16;

/// Collects bytes before they are hashed, because hashing a few bytes at a time is slow.
struct Chunks {
    hasher: blake3::Hasher,
    bytes: Vec<u8>,
}

impl Chunks {
    fn add(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
        if self.bytes.len() >= CHUNK {
            self.hasher.update(&self.bytes);
            self.bytes.clear();
        }
    }
}

/// The BLAKE3 hash of a mesh's content; displayed as 64 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ContentHash(pub [u8; 32]);

impl ContentHash {
    /// Returns the hash of a soup's vertices (bit for bit) and faces. The hash does not depend on
    /// the file format.
    pub fn of_soup(soup: &PolygonSoup) -> Self {
        let mut chunks = Chunks { hasher: blake3::Hasher::new(), bytes: Vec::with_capacity(2 * CHUNK) };
        chunks.add(b"palpus soup 1");
        chunks.add(&(soup.vertices.len() as u64).to_le_bytes());
        chunks.add(&(soup.face_count() as u64).to_le_bytes());
        for vertex in &soup.vertices {
            for x in vertex.to_array() {
                chunks.add(&x.to_le_bytes());
            }
        }
        for face in 0..soup.face_count() {
            let face = soup.face(face);
            chunks.add(&(face.len() as u32).to_le_bytes());
            for corner in face {
                chunks.add(&corner.to_le_bytes());
            }
        }
        let Chunks { mut hasher, bytes } = chunks;
        Self(*hasher.update(&bytes).finalize().as_bytes())
    }

    /// Returns the hash of any bytes, for example of settings.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }
}

impl fmt::Display for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// The text is not 64 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a content hash must have 64 hexadecimal digits")]
pub struct NotAContentHash;

impl FromStr for ContentHash {
    type Err = NotAContentHash;

    fn from_str(text: &str) -> Result<Self, NotAContentHash> {
        let digits: Vec<u32> = text.chars().map(|c| c.to_digit(16)).collect::<Option<_>>().ok_or(NotAContentHash)?;
        if digits.len() != 64 {
            return Err(NotAContentHash);
        }
        Ok(Self(std::array::from_fn(|k| (digits[2 * k] << 4 | digits[2 * k + 1]) as u8)))
    }
}

impl Serialize for ContentHash {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for ContentHash {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}
