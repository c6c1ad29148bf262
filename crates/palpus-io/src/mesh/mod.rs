//! Reads mesh files (OBJ, STL, PLY, OFF, glTF and GLB, also compressed by gzip) into a
//! [`PolygonSoup`], and writes groups of polygons as OBJ.
//!
//! * Each file gives either a soup whose coordinates are finite and whose indices are in range, or
//!   a [`MeshFileError`] that describes the problem, its location and how to fix it. No input
//!   causes a panic.
//! * A face with fewer than three corners is an error in every format. Faces that repeat a vertex
//!   or have no area are accepted, since the engine checks the shape.
//! * Counts in a file are compared with the file size before memory is allocated. Reading needs a
//!   small multiple of the file size as memory: a factor of two was measured for usual files, and a
//!   factor of eight for the worst file. Two kinds of glTF files need more: files that repeat one
//!   mesh many times (up to a limit), and lists of millions of empty nodes (a factor of thirty).
//! * Lengths stay in the unit of the file.

mod builder;
mod content;
mod fault;
pub mod gltf;
mod lines;
pub mod obj;
mod obj_writer;
pub mod off;
pub mod ply;
pub mod stl;

use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use palpus::body::PolygonSoup;

pub use builder::MAX_COORDINATE;
pub use content::ContentHash;
pub use fault::{MeshFileError, MeshProblem, Place};
pub use obj_writer::write_obj_groups;

use lines::{Lines, shown, words};

/// Size of the largest file that is read, in bytes. In every format, a file of this size exceeds
/// 32-bit indices.
const MAX_FILE_BYTES: u64 = 1 << 33;
/// Largest size of the content of a compressed file, in bytes.
const MAX_UNPACKED_BYTES: u64 = 1 << 32;
/// The first bytes of a file compressed by gzip.
const GZIP: &[u8] = b"\x1F\x8B";
/// Number of bytes that are examined to guess the format of a file.
const SNIFFED: usize = 1 << 16;

/// A format of a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Wavefront OBJ.
    Obj,
    /// STL, binary or ASCII.
    Stl,
    /// PLY, binary or ASCII.
    Ply,
    /// OFF, ASCII.
    Off,
    /// glTF 2.0, as JSON or GLB.
    Gltf,
}

impl MeshFormat {
    /// Returns the format for a file's extension; `None` if the extension is unknown. Upper and
    /// lower case are equal.
    pub fn of_extension(path: &Path) -> Option<Self> {
        Some(match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "obj" => Self::Obj,
            "stl" => Self::Stl,
            "ply" => Self::Ply,
            "off" | "coff" | "noff" => Self::Off,
            "gltf" | "glb" => Self::Gltf,
            _ => return None,
        })
    }

    /// Guesses the format from the content of a file; `None` if no format fits.
    pub fn of_content(bytes: &[u8]) -> Option<Self> {
        let start = &bytes[..bytes.len().min(SNIFFED)];
        let first = Lines::new(start).find_map(|(_, line)| words(line).next());
        if start.starts_with(b"glTF") || start.trim_ascii_start().starts_with(b"{") {
            Some(Self::Gltf)
        } else if first == Some(b"ply") {
            Some(Self::Ply)
        } else if first.is_some_and(off::is_header) {
            Some(Self::Off)
        } else if stl::has_binary_length(bytes) || stl::is_ascii(bytes) {
            Some(Self::Stl)
        } else {
            let is_obj = |line| matches!(words(line).next(), Some(b"v" | b"f" | b"mtllib"));
            Lines::new(start).any(|(_, line)| is_obj(line)).then_some(Self::Obj)
        }
    }

    /// Returns the name of the format.
    pub fn name(self) -> &'static str {
        match self {
            Self::Obj => "OBJ",
            Self::Stl => "STL",
            Self::Ply => "PLY",
            Self::Off => "OFF",
            Self::Gltf => "glTF",
        }
    }
}

/// Reads a mesh file. The format is guessed from the content; if no format fits, the extension
/// decides.
///
/// # Errors
/// Fails if the file cannot be read or does not follow its format. The error contains the location.
pub fn read_mesh(path: &Path) -> Result<PolygonSoup, MeshFileError> {
    read_mesh_noting(path, &mut |_| ())
}

/// Reads a mesh file like [`read_mesh`], and calls `note` with a message if the content and the
/// extension indicate different formats.
///
/// # Errors
/// Same as [`read_mesh`].
pub fn read_mesh_noting(path: &Path, note: &mut dyn FnMut(String)) -> Result<PolygonSoup, MeshFileError> {
    let name = path.display().to_string();
    let error = |problem| MeshFileError { file: name.clone(), place: Place::File, problem: Box::new(problem) };
    let bytes = read_file(path, MAX_FILE_BYTES + 1).map_err(|e| error(MeshProblem::Unreadable(e)))?;
    parse_mesh(bytes, &name, Some(path), note)
}

/// Reads a mesh from the content of a file. The format is guessed from the content. Fails like
/// [`read_mesh`]; `name` is the name of the content in errors. A glTF document must contain its
/// buffers.
pub fn read_mesh_from(bytes: Vec<u8>, name: &str) -> Result<PolygonSoup, MeshFileError> {
    parse_mesh(bytes, name, None, &mut |_| ())
}

/// Reads a mesh from the content of the file `path`. `None` if the content is not from a file.
fn parse_mesh(
    bytes: Vec<u8>,
    name: &str,
    path: Option<&Path>,
    note: &mut dyn FnMut(String),
) -> Result<PolygonSoup, MeshFileError> {
    let error = |problem| MeshFileError { file: name.to_owned(), place: Place::File, problem: Box::new(problem) };
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(error(MeshProblem::TooLarge("the file is larger than 8 GiB".to_owned())));
    }
    let (bytes, path) = if bytes.starts_with(GZIP) {
        let unpacked = unpack(&bytes).map_err(|what| error(MeshProblem::Malformed(what)))?;
        (unpacked, path.map(|path| path.with_extension("")))
    } else {
        (bytes, path.map(Path::to_owned))
    };
    let path = path.as_deref();
    if bytes.is_empty() {
        return Err(error(MeshProblem::Malformed("the file is empty; export the mesh again".to_owned())));
    }
    let parse = |format| match format {
        MeshFormat::Obj => obj::parse(&bytes, name),
        MeshFormat::Stl => stl::parse(&bytes, name),
        MeshFormat::Ply => ply::parse(&bytes, name),
        MeshFormat::Off => off::parse(&bytes, name),
        MeshFormat::Gltf => gltf::parse_with(&bytes, name, &mut |uri, length| fetch_beside(path, uri, length)),
    };
    match (MeshFormat::of_content(&bytes), path.and_then(MeshFormat::of_extension)) {
        (Some(content), Some(extension)) if content != extension => match parse(content) {
            Ok(soup) => {
                let (is, named) = (content.name(), extension.name());
                note(format!("{name} is named as {named}, but its content is {is}; it was read as {is}"));
                Ok(soup)
            }
            // The format guessed from the content may be wrong, so the extension is tried too.
            Err(error) => parse(extension).map_err(|_| error),
        },
        (Some(format), _) | (None, Some(format)) => parse(format),
        (None, None) => Err(error(MeshProblem::Unsupported(unknown_format(path, &bytes)))),
    }
}

/// Decompresses a file compressed by gzip; fails with a description of the problem.
fn unpack(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut content = Vec::new();
    let mut unpacked = flate2::read::MultiGzDecoder::new(bytes).take(MAX_UNPACKED_BYTES + 1);
    unpacked
        .read_to_end(&mut content)
        .map_err(|e| format!("the compressed content is damaged ({e}); pack it again"))?;
    if content.len() as u64 > MAX_UNPACKED_BYTES {
        return Err("the compressed content is larger than 4 GiB".to_owned());
    }
    Ok(content)
}

/// Reads at most `limit` bytes of a file.
fn read_file(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    if file.metadata()?.is_dir() {
        return Err(io::Error::other("it is a folder"));
    }
    let mut bytes = Vec::new();
    file.take(limit).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Returns the error text for a file of unknown format.
fn unknown_format(path: Option<&Path>, bytes: &[u8]) -> String {
    let read = "OBJ, STL, PLY, OFF, glTF and GLB are supported";
    if bytes.starts_with(b"PK\x03\x04") {
        return format!("the file is a zip archive, which is not supported; unpack it first ({read})");
    }
    match path.and_then(Path::extension) {
        Some(extension) => {
            let extension = shown(extension.as_encoded_bytes());
            format!("the format `{extension}` is not supported; export the mesh in another ({read})")
        }
        None => format!("the content has no supported format; export the mesh in another ({read})"),
    }
}

/// Reads the first `length` bytes of a file that a mesh file refers to. That file must be in the
/// folder of the mesh file or in a subfolder.
fn fetch_beside(mesh: Option<&Path>, uri: &str, length: u64) -> io::Result<Vec<u8>> {
    let Some(mesh) = mesh else {
        return Err(io::Error::other("the mesh is not read from a file; write its buffers into the document"));
    };
    let decoded = percent_decoded(uri).ok_or_else(|| io::Error::other("its name is not a valid URI"))?;
    let relative = PathBuf::from(decoded);
    let stays = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !stays || uri.contains("://") {
        return Err(io::Error::other("it lies outside the mesh file's folder"));
    }
    let folder = mesh.parent().unwrap_or(Path::new(""));
    read_file(&folder.join(relative), length)
}

/// Decodes the percent escapes (such as `%20`) of a URI.
fn percent_decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        rest = after;
        if first == b'%' {
            let digits = std::str::from_utf8(after.get(..2)?).ok()?;
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = &after[2..];
        } else {
            bytes.push(first);
        }
    }
    String::from_utf8(bytes).ok()
}
