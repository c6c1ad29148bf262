//! Reads glTF 2.0 and GLB: the triangles of the default scene, transformed by its nodes.
//!
//! 1. A GLB file is split into its JSON chunk and its binary chunk.
//! 2. Required extensions that could change the surface (Draco, meshopt, quantisation, …) give an
//!    error that names the extension. Extensions that only change the appearance are ignored.
//! 3. The nodes of the default scene are visited from their roots. Without a default scene, the
//!    first scene is used; without scenes, all nodes. A node that is reached twice is an error, so
//!    the traversal ends.
//! 4. Each primitive of a node's mesh gives its triangles (lists, strips or fans; indexed by u8,
//!    u16, u32 or without indices). Points and lines are ignored. If a node's transform is a
//!    reflection, its triangles are reversed.
//! 5. The data of a buffer is the binary chunk, base64 in the JSON, or a file beside the glTF file.
//!    Each accessor is checked against its view, its buffer and its component type before it is
//!    read.
//!
//! Skins and morph targets are ignored: the rest pose is read. Sparse accessors give an error.
//! Lengths stay in the unit of the file. The glTF standard prescribes metres, but the scene file
//! states the unit, as for all other formats.
//!
//! We use `serde_json` and not the crate `gltf`. That crate subtracts 12 from the stated length of
//! a GLB file without a check, which panics in debug builds. The crate calls `unwrap` in many
//! places, although its validation does not check the bytes of accessors. The crate also computes
//! the transforms of nodes in f32. We need only a small part of the format.

mod accessor;
mod document;
mod nodes;

use std::borrow::Cow;
use std::collections::HashMap;
use std::io;

use data_encoding::BASE64_NOPAD;
use glam::{DMat4, DVec3};
use palpus::body::PolygonSoup;

use super::builder::SoupBuilder;
use super::fault::{Fault, MeshFileError, MeshProblem, Place};
use crate::one_line::one_line;
use accessor::{F32, U8, U16, U32, items};
use document::{Primitive, Root, check_version_and_extensions, split_glb};
use nodes::visit_nodes;

/// Largest number of corners (and of vertices) that repeated meshes may produce, unless the file
/// has more bytes than this limit: about 100 MB, or a thousand copies of a mesh of a thousand
/// triangles.
const MAX_INSTANCED: u64 = 1 << 22;

/// Reads the first bytes of a file beside the glTF file. The arguments are its URI and the
/// number of bytes; a shorter file gives fewer bytes.
pub type Fetch<'f> = dyn FnMut(&str, u64) -> io::Result<Vec<u8>> + 'f;

/// Reads a glTF or GLB file that needs no other file. `name` is the name of the file in error
/// messages.
pub fn parse(bytes: &[u8], name: &str) -> Result<PolygonSoup, MeshFileError> {
    parse_with(bytes, name, &mut |_, _| Err(io::Error::other("other files may not be read")))
}

/// Reads a glTF or GLB file; `fetch` reads the other files to which it refers.
pub fn parse_with(bytes: &[u8], name: &str, fetch: &mut Fetch<'_>) -> Result<PolygonSoup, MeshFileError> {
    read(bytes, fetch).map_err(|fault| fault.of(name))
}

fn read<'a>(bytes: &'a [u8], fetch: &'a mut Fetch<'a>) -> Result<PolygonSoup, Fault> {
    let (json, chunk) = if bytes.starts_with(b"glTF") { split_glb(bytes)? } else { (bytes, None) };
    let json = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
    let root: Root = serde_json::from_slice(json).map_err(|error| {
        let problem = one_line(&error.to_string());
        Fault::malformed(
            Place::Line(error.line() as u64),
            format!("the JSON is invalid: {problem}; export the mesh again"),
        )
    })?;
    check_version_and_extensions(&root)?;
    let buffers = vec![None; root.buffers.len()];
    let mut reading = Reading {
        root: &root,
        chunk,
        buffers,
        fetch,
        soup: SoupBuilder::new(0),
        limit: MAX_INSTANCED.max(bytes.len() as u64),
    };
    visit_nodes(&root, |node, matrix| match root.nodes[node].mesh {
        Some(mesh) => reading.mesh(mesh, matrix),
        None => Ok(()),
    })?;
    if root.nodes.is_empty() {
        for mesh in 0..root.meshes.len() {
            reading.mesh(mesh, &DMat4::IDENTITY)?;
        }
    }
    reading.soup.finish()
}

/// The state of a reader.
struct Reading<'a> {
    root: &'a Root,
    chunk: Option<&'a [u8]>,
    /// Each buffer is loaded when it is first used.
    buffers: Vec<Option<Cow<'a, [u8]>>>,
    fetch: &'a mut Fetch<'a>,
    soup: SoupBuilder,
    limit: u64,
}

impl Reading<'_> {
    /// Appends a mesh, transformed by `matrix`.
    fn mesh(&mut self, index: usize, matrix: &DMat4) -> Result<(), Fault> {
        let root = self.root;
        let place = Place::Element("mesh", index as u64);
        let Some(mesh) = root.meshes.get(index) else {
            return Err(Fault::malformed(place, "the mesh does not exist; export the mesh again"));
        };
        // Primitives of one mesh often share their vertices.
        let mut bases = HashMap::new();
        for primitive in &mesh.primitives {
            let mode = primitive.mode.unwrap_or(4);
            let Some(position) = primitive.attributes.position else { continue };
            match mode {
                0..=3 => continue,
                4..=6 => {}
                _ => {
                    return Err(Fault::malformed(
                        place,
                        format!("a primitive has mode {mode}, which does not exist in glTF; export the mesh again"),
                    ));
                }
            }
            let base = match bases.get(&position) {
                Some(&base) => base,
                None => {
                    let base = self.vertices(position, matrix)?;
                    bases.insert(position, base);
                    base
                }
            };
            self.primitive(primitive, mode, position, base, matrix.determinant() < 0.0)?;
        }
        Ok(())
    }

    /// Appends the positions of an accessor, transformed by `matrix`, and returns the index of the
    /// first new vertex.
    fn vertices(&mut self, index: usize, matrix: &DMat4) -> Result<u64, Fault> {
        let base = self.soup.vertex_count();
        let root = self.root;
        self.load(index)?;
        let items = items(root, &self.buffers, index, "VEC3", &[(F32, 12)])?;
        check_limit(base + items.count, self.limit)?;
        self.soup.reserve_vertices(items.count);
        for (k, bytes) in items.each::<12>().enumerate() {
            let place = Place::Part("accessor", index as u64, "vertex", k as u64);
            let xyz: [f64; 3] = std::array::from_fn(|axis| {
                let at = 4 * axis;
                f64::from(f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]))
            });
            let placed = matrix.transform_point3(DVec3::from_array(xyz));
            let finite = xyz.iter().all(|x| x.is_finite());
            let shown = if finite { placed.to_array() } else { xyz };
            self.soup.vertex(shown, place, |axis| format!("{:?}", shown[axis]))?;
        }
        Ok(base)
    }

    /// Appends the triangles of a primitive. Vertex 0 of the primitive is vertex `base` of the
    /// soup.
    fn primitive(
        &mut self,
        primitive: &Primitive,
        mode: u32,
        position: usize,
        base: u64,
        mirrored: bool,
    ) -> Result<(), Fault> {
        let count = self.root.accessors.get(position).map_or(0, |accessor| accessor.count);
        let (corners, place) = match primitive.indices {
            Some(index) => (self.indices(index, count)?, Place::Element("accessor", index as u64)),
            None => ((0..count as u32).collect(), Place::Element("accessor", position as u64)),
        };
        let triangles = if mode == 4 { corners.len() / 3 } else { corners.len().saturating_sub(2) };
        check_limit(self.soup.corner_count() + 3 * triangles as u64, self.limit)?;
        if mode == 4 && corners.len() % 3 != 0 {
            let what = format!("{} corners do not make whole triangles; export the mesh again", corners.len());
            return Err(Fault::malformed(place, what));
        }
        for k in 0..triangles {
            let [a, mut b, mut c] = match mode {
                4 => [3 * k, 3 * k + 1, 3 * k + 2],
                5 if k % 2 == 0 => [k, k + 1, k + 2],
                5 => [k, k + 2, k + 1],
                _ => [k + 1, k + 2, 0],
            };
            if mirrored {
                std::mem::swap(&mut b, &mut c);
            }
            let triangle = [a, b, c].map(|corner| base + u64::from(corners[corner]));
            self.soup.triangle(triangle, place)?;
        }
        Ok(())
    }

    /// Returns the indices in an accessor; fails if an index is not less than `count`.
    fn indices(&mut self, index: usize, count: u64) -> Result<Vec<u32>, Fault> {
        let root = self.root;
        self.load(index)?;
        let items = items(root, &self.buffers, index, "SCALAR", &[(U8, 1), (U16, 2), (U32, 4)])?;
        let indices: Vec<u32> = match root.accessors[index].component_type {
            U8 => items.each::<1>().map(|bytes| u32::from(bytes[0])).collect(),
            U16 => items.each::<2>().map(|bytes| u32::from(u16::from_le_bytes(bytes))).collect(),
            _ => items.each::<4>().map(u32::from_le_bytes).collect(),
        };
        match indices.iter().position(|&vertex| u64::from(vertex) >= count) {
            None => Ok(indices),
            Some(k) => {
                let place = Place::Part("accessor", index as u64, "index", k as u64);
                let problem = MeshProblem::IndexOutOfRange { index: indices[k].into(), count, first: 0 };
                Err(Fault::new(place, problem))
            }
        }
    }

    /// Loads the buffer of an accessor. If the accessor, its view or its buffer does not exist,
    /// this does nothing, because `items` reports the error.
    fn load(&mut self, accessor: usize) -> Result<(), Fault> {
        let root = self.root;
        let view = root.accessors.get(accessor).and_then(|accessor| root.buffer_views.get(accessor.buffer_view?));
        let Some((index, buffer)) = view.and_then(|view| Some((view.buffer, root.buffers.get(view.buffer)?))) else {
            return Ok(());
        };
        if self.buffers[index].is_some() {
            return Ok(());
        }
        let place = Place::Element("buffer", index as u64);
        let bytes: Cow<'_, [u8]> = match (&buffer.uri, self.chunk) {
            (None, Some(chunk)) if index == 0 => Cow::Borrowed(chunk),
            (None, _) => return Err(Fault::malformed(place, "the buffer has no data; export the mesh again")),
            (Some(uri), _) if uri.starts_with("data:") => Cow::Owned(data_uri(uri, place)?),
            (Some(uri), _) => {
                if root.buffers[..index].iter().any(|other| other.uri.as_ref() == Some(uri)) {
                    let what = format!("two buffers are the same file {uri:?}; export the mesh again");
                    return Err(Fault::malformed(place, what));
                }
                let fetched = (self.fetch)(uri, buffer.byte_length);
                Cow::Owned(fetched.map_err(|error| {
                    let what = format!(
                        "the file {uri:?} beside it cannot be read ({error}); add the file or export the mesh as GLB"
                    );
                    Fault::malformed(place, what)
                })?)
            }
        };
        if (bytes.len() as u64) < buffer.byte_length {
            let within = format!("in this buffer, after {} of {} bytes", bytes.len(), buffer.byte_length);
            return Err(Fault::truncated(place, within));
        }
        self.buffers[index] = Some(bytes);
        Ok(())
    }
}

fn check_limit(count: u64, limit: u64) -> Result<(), Fault> {
    if count <= limit {
        return Ok(());
    }
    let what = format!("its nodes repeat the meshes so often that there are more than {limit} vertices or corners");
    Err(Fault::new(Place::File, MeshProblem::TooLarge(what)))
}

/// Decodes the base64 data of a `data:` URI. The padding is optional, because some programs write
/// none.
fn data_uri(uri: &str, place: Place) -> Result<Vec<u8>, Fault> {
    let data = uri.split_once(";base64,").and_then(|(_, text)| {
        let unpadded = text.strip_suffix("==").or_else(|| text.strip_suffix('=')).unwrap_or(text);
        BASE64_NOPAD.decode(unpadded.as_bytes()).ok()
    });
    data.ok_or_else(|| Fault::malformed(place, "the embedded data is not base64; export the mesh again"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_json_text_gives_a_short_error() {
        let error = parse(format!("{:?}", "\u{7f}".repeat(1000)).as_bytes(), "x");
        let text = error.unwrap_err().to_string();
        assert!(text.contains("line 1: the JSON is invalid") && text.len() < 700, "{text}");
    }

    #[test]
    fn padding_of_embedded_data_is_optional() {
        let read = |text: &str| data_uri(&format!("data:;base64,{text}"), Place::File).ok();
        for (text, bytes) in [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg", "foob")] {
            assert_eq!(read(text).as_deref(), Some(bytes.as_bytes()), "{text}");
        }
        for text in ["Z", "Zm9v!", "=Zm9", "Zm9vY"] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
