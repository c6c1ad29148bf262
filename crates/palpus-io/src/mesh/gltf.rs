//! glTF 2.0 and GLB: the triangles of the default scene, placed by their nodes.
//!
//! 1. A GLB file is split into its JSON and its binary chunk.
//! 2. Required extensions that could change the surface (Draco, meshopt, quantisation, …) are refused by name; those
//!    that only change its looks pass.
//! 3. The nodes of the default scene (else of the first, else all) are walked from their roots; a node that is reached
//!    twice is an error, so the walk ends.
//! 4. Each primitive of a node's mesh gives its triangles (lists, strips, fans; indexed by u8, u16, u32 or not at all);
//!    points and lines are passed over. A node that mirrors turns its triangles around.
//! 5. Buffers are the binary chunk, base64 in the JSON, or a file beside the glTF; every accessor is held against its
//!    view, its buffer and its component type before a byte of it is read.
//!
//! Skins and morph targets are ignored: what is read is the rest pose. Sparse accessors are refused. Lengths come in
//! the file's unit, which glTF says is the metre; the scene file decides here as for every other format.
//!
//! Our own reader over `serde_json` and not the crate `gltf`: that one panics on a GLB whose header states fewer than
//! 12 bytes, unwraps throughout on the promise of a validation that does not look at the bytes behind an accessor, and
//! places nodes in f32. What is needed of the format is small.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io;

use glam::{DMat4, DQuat, DVec3};
use palpus::body::PolygonSoup;
use serde::Deserialize;

use super::base64;
use super::builder::SoupBuilder;
use super::fault::{Fault, MeshFileError, MeshProblem, Place};

/// Corners (and vertices) that a file may grow to by placing its meshes many times, if it is not itself larger.
const MAX_INSTANCED: u64 = 1 << 22;

/// Reads the bytes of a glTF or GLB file that needs no other file; `name` is how errors call the file.
pub fn parse(bytes: &[u8], name: &str) -> Result<PolygonSoup, MeshFileError> {
    parse_with(bytes, name, &mut |_, _| Err(io::Error::other("no file beside this one may be read")))
}

/// Reads the bytes of a glTF or GLB file; `fetch(uri, length)` gives the first `length` bytes (fewer if there are not
/// so many) of a file beside it.
pub fn parse_with(
    bytes: &[u8],
    name: &str,
    fetch: &mut dyn FnMut(&str, u64) -> io::Result<Vec<u8>>,
) -> Result<PolygonSoup, MeshFileError> {
    read(bytes, fetch).map_err(|fault| fault.of(name))
}

fn read(bytes: &[u8], fetch: &mut dyn FnMut(&str, u64) -> io::Result<Vec<u8>>) -> Result<PolygonSoup, Fault> {
    let (json, chunk) = if bytes.starts_with(b"glTF") { split_glb(bytes)? } else { (bytes, None) };
    let json = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
    let root: Root = serde_json::from_slice(json).map_err(|error| {
        Fault::malformed(Place::Line(error.line() as u64), format!("the JSON is wrong: {error}; export the mesh again"))
    })?;
    check_version_and_extensions(&root)?;
    let buffers = vec![None; root.buffers.len()];
    let mut reading = Reading {
        root: &root,
        chunk,
        buffers,
        soup: SoupBuilder::new(0),
        limit: MAX_INSTANCED.max(bytes.len() as u64),
    };
    for (node, matrix) in place_nodes(&root)? {
        if let Some(mesh) = root.nodes[node].mesh {
            reading.mesh(mesh, &matrix, fetch)?;
        }
    }
    if root.nodes.is_empty() {
        for mesh in 0..root.meshes.len() {
            reading.mesh(mesh, &DMat4::IDENTITY, fetch)?;
        }
    }
    reading.soup.finish()
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Root {
    asset: Asset,
    scene: Option<usize>,
    #[serde(default)]
    scenes: Vec<Scene>,
    #[serde(default)]
    nodes: Vec<Node>,
    #[serde(default)]
    meshes: Vec<Mesh>,
    #[serde(default)]
    accessors: Vec<Accessor>,
    #[serde(default)]
    buffer_views: Vec<View>,
    #[serde(default)]
    buffers: Vec<Buffer>,
    #[serde(default)]
    extensions_required: Vec<String>,
}

#[derive(Deserialize)]
struct Asset {
    version: String,
}

#[derive(Deserialize)]
struct Scene {
    #[serde(default)]
    nodes: Vec<usize>,
}

/// The placements are boxed so that a list of empty nodes does not take a hundred times the text's memory.
#[derive(Deserialize)]
struct Node {
    mesh: Option<usize>,
    #[serde(default)]
    children: Vec<usize>,
    matrix: Option<Box<[f64; 16]>>,
    translation: Option<Box<[f64; 3]>>,
    rotation: Option<Box<[f64; 4]>>,
    scale: Option<Box<[f64; 3]>>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: Attributes,
    indices: Option<usize>,
    mode: Option<u32>,
}

#[derive(Deserialize)]
struct Attributes {
    #[serde(rename = "POSITION")]
    position: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: u64,
    component_type: u32,
    count: u64,
    #[serde(rename = "type")]
    shape: Box<str>,
    sparse: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: usize,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: Option<u64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Buffer {
    uri: Option<String>,
    byte_length: u64,
}

/// Component types of the format.
const U8: u32 = 5121;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// The JSON chunk and the binary chunk, if there is one.
fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    let word = |at: usize| {
        let bytes = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(Fault::truncated(Place::File, "in its header"));
    };
    if version != 2 {
        return Err(Fault::unsupported(
            Place::File,
            format!("GLB version {version} is not read, only 2; export it again"),
        ));
    }
    if (length as usize) > bytes.len() {
        return Err(Fault::truncated(Place::File, format!("after {} of {length} bytes", bytes.len())));
    }
    let mut chunks = [None; 2];
    let mut at = 12;
    for (k, (chunk, kind)) in chunks.iter_mut().zip([b"JSON", b"BIN\0"]).enumerate() {
        let (Some(length), Some(found)) = (word(at), bytes.get(at + 4..at + 8)) else { break };
        let place = Place::Element("chunk", k as u64);
        if found != kind {
            let what = format!("the chunk is not {}; export the mesh again", ["JSON", "BIN"][k]);
            return Err(Fault::malformed(place, what));
        }
        let start = at + 8;
        let end = start.saturating_add(length as usize);
        let data = bytes.get(start..end);
        *chunk = Some(data.ok_or_else(|| Fault::truncated(place, "inside this chunk"))?);
        at = end.saturating_add(3) & !3;
    }
    match chunks {
        [Some(json), binary] => Ok((json, binary)),
        _ => Err(Fault::truncated(Place::File, "before its JSON chunk")),
    }
}

fn check_version_and_extensions(root: &Root) -> Result<(), Fault> {
    if !root.asset.version.starts_with("2.") {
        let what = format!("glTF version {:?} is not read, only 2.x; export the mesh again", root.asset.version);
        return Err(Fault::unsupported(Place::File, what));
    }
    let looks_only = |name: &str| {
        ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "EXT_lights_", "KHR_xmp"]
            .iter()
            .any(|prefix| name.starts_with(prefix))
    };
    match root.extensions_required.iter().find(|name| !looks_only(name)) {
        None => Ok(()),
        Some(name) => {
            let what = format!(
                "it needs the extension {name:?}, which is not read; export the mesh without it (no compression)"
            );
            Err(Fault::unsupported(Place::File, what))
        }
    }
}

/// The nodes of the scene with their placements in it.
fn place_nodes(root: &Root) -> Result<Vec<(usize, DMat4)>, Fault> {
    let mut seen = vec![false; root.nodes.len()];
    let mut placed: Vec<(usize, DMat4)> = Vec::new();
    let mut reach = |node: usize, parent: Option<usize>| -> Result<usize, Fault> {
        let place = parent.map_or(Place::File, |parent| Place::Element("node", parent as u64));
        match seen.get_mut(node) {
            None => {
                Err(Fault::malformed(place, format!("node {node} is named but does not exist; export the mesh again")))
            }
            Some(true) => {
                let what = format!("node {node} is reached twice, but nodes must form trees; export the mesh again");
                Err(Fault::malformed(place, what))
            }
            Some(unseen) => {
                *unseen = true;
                Ok(node)
            }
        }
    };
    for node in roots(root)? {
        placed.push((reach(node, None)?, own_matrix(root, node)?));
    }
    let mut next = 0;
    while next < placed.len() {
        let (parent, matrix) = placed[next];
        for &child in &root.nodes[parent].children {
            placed.push((reach(child, Some(parent))?, matrix * own_matrix(root, child)?));
        }
        next += 1;
    }
    Ok(placed)
}

/// The root nodes of the default scene; without scenes, the nodes that are nobody's child.
fn roots(root: &Root) -> Result<Vec<usize>, Fault> {
    if root.scenes.is_empty() && root.scene.is_none() {
        let mut is_child = vec![false; root.nodes.len()];
        for &child in root.nodes.iter().flat_map(|node| &node.children) {
            if let Some(is_child) = is_child.get_mut(child) {
                *is_child = true;
            }
        }
        return Ok((0..root.nodes.len()).filter(|&node| !is_child[node]).collect());
    }
    let scene = root.scene.unwrap_or(0);
    match root.scenes.get(scene) {
        Some(scene) => Ok(scene.nodes.clone()),
        None => Err(Fault::malformed(
            Place::File,
            format!("scene {scene} is named but does not exist; export the mesh again"),
        )),
    }
}

/// A node's placement in its parent.
fn own_matrix(root: &Root, index: usize) -> Result<DMat4, Fault> {
    let Some(node) = root.nodes.get(index) else { return Ok(DMat4::IDENTITY) };
    if let Some(matrix) = &node.matrix {
        return Ok(DMat4::from_cols_array(matrix));
    }
    let rotation = node.rotation.as_ref().map_or(DQuat::IDENTITY, |q| DQuat::from_array(**q));
    let length = rotation.length();
    if !(length.is_finite() && length > 0.5) {
        let what = "the rotation is not a unit quaternion; export the mesh again";
        return Err(Fault::malformed(Place::Element("node", index as u64), what));
    }
    let translation = node.translation.as_ref().map_or(DVec3::ZERO, |t| DVec3::from_array(**t));
    let scale = node.scale.as_ref().map_or(DVec3::ONE, |s| DVec3::from_array(**s));
    Ok(DMat4::from_scale_rotation_translation(scale, rotation.normalize(), translation))
}

/// A file being read.
struct Reading<'a> {
    root: &'a Root,
    chunk: Option<&'a [u8]>,
    /// Loaded when first used.
    buffers: Vec<Option<Cow<'a, [u8]>>>,
    soup: SoupBuilder,
    limit: u64,
}

/// The bytes of an accessor: `count` items, `stride` bytes apart.
struct Items<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: u64,
}

impl Items<'_> {
    /// The first `N` bytes of each item. The last item may be shorter than the stride.
    fn each<const N: usize>(&self) -> impl Iterator<Item = [u8; N]> {
        let count = self.count as usize;
        self.bytes.chunks(self.stride).take(count).filter_map(|item| item.first_chunk().copied())
    }
}

impl Reading<'_> {
    /// Appends a mesh, placed.
    fn mesh(
        &mut self,
        index: usize,
        matrix: &DMat4,
        fetch: &mut dyn FnMut(&str, u64) -> io::Result<Vec<u8>>,
    ) -> Result<(), Fault> {
        let root = self.root;
        let place = Place::Element("mesh", index as u64);
        let Some(mesh) = root.meshes.get(index) else {
            return Err(Fault::malformed(place, "the mesh is named but does not exist; export the mesh again"));
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
                        format!("a primitive has mode {mode}, which glTF does not know"),
                    ));
                }
            }
            let base = match bases.get(&position) {
                Some(&base) => base,
                None => {
                    let base = self.vertices(position, matrix, fetch)?;
                    bases.insert(position, base);
                    base
                }
            };
            self.primitive(primitive, mode, position, base, matrix.determinant() < 0.0, fetch)?;
        }
        Ok(())
    }

    /// Appends the positions of an accessor, placed; returns the number of the first.
    fn vertices(
        &mut self,
        index: usize,
        matrix: &DMat4,
        fetch: &mut dyn FnMut(&str, u64) -> io::Result<Vec<u8>>,
    ) -> Result<u64, Fault> {
        let base = self.soup.vertex_count();
        let root = self.root;
        self.load(index, fetch)?;
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

    /// Appends the triangles of a primitive whose vertex 0 is the soup's vertex `base`.
    fn primitive(
        &mut self,
        primitive: &Primitive,
        mode: u32,
        position: usize,
        base: u64,
        mirrored: bool,
        fetch: &mut dyn FnMut(&str, u64) -> io::Result<Vec<u8>>,
    ) -> Result<(), Fault> {
        let count = self.root.accessors.get(position).map_or(0, |accessor| accessor.count);
        let (corners, place) = match primitive.indices {
            Some(index) => (self.indices(index, count, fetch)?, Place::Element("accessor", index as u64)),
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

    /// The indices in an accessor, each below `count`.
    fn indices(
        &mut self,
        index: usize,
        count: u64,
        fetch: &mut dyn FnMut(&str, u64) -> io::Result<Vec<u8>>,
    ) -> Result<Vec<u32>, Fault> {
        let root = self.root;
        self.load(index, fetch)?;
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

    /// Makes sure that the buffer behind an accessor is loaded. (Accessors that name nothing are found out later.)
    fn load(&mut self, accessor: usize, fetch: &mut dyn FnMut(&str, u64) -> io::Result<Vec<u8>>) -> Result<(), Fault> {
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
                let fetched = fetch(uri, buffer.byte_length);
                Cow::Owned(fetched.map_err(|error| {
                    let what =
                        format!("the file {uri:?} beside it cannot be read ({error}); put it there or export as GLB");
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
    let what = format!("its nodes place its meshes so often that they make more than {limit} vertices or corners");
    Err(Fault::new(Place::File, MeshProblem::TooLarge(what)))
}

/// The bytes of the base64 in a `data:` URI.
fn data_uri(uri: &str, place: Place) -> Result<Vec<u8>, Fault> {
    let data = uri.split_once(";base64,").and_then(|(_, text)| base64::decode(text.as_bytes()));
    data.ok_or_else(|| Fault::malformed(place, "the embedded data is not base64; export the mesh again"))
}

/// The items of an accessor, which must have the given shape and one of the given component types (with item sizes).
fn items<'b>(
    root: &Root,
    buffers: &'b [Option<Cow<'_, [u8]>>],
    index: usize,
    shape: &str,
    types: &[(u32, u64)],
) -> Result<Items<'b>, Fault> {
    let place = Place::Element("accessor", index as u64);
    let missing =
        |what: &str| Fault::malformed(place, format!("{what} is named but does not exist; export the mesh again"));
    let accessor = root.accessors.get(index).ok_or_else(|| missing("the accessor"))?;
    let Some(&(_, size)) = types.iter().find(|&&(kind, _)| kind == accessor.component_type) else {
        let what = format!("component type {} cannot be used here; export the mesh again", accessor.component_type);
        return Err(Fault::malformed(place, what));
    };
    if &*accessor.shape != shape {
        let what = format!("its type is {:?} and should be {shape}; export the mesh again", accessor.shape);
        return Err(Fault::malformed(place, what));
    }
    let Some(view) = accessor.buffer_view.filter(|_| accessor.sparse.is_none()) else {
        let what = "it is sparse or compressed (Draco?), which is not read; export the mesh without compression";
        return Err(Fault::unsupported(place, what));
    };
    let view = root.buffer_views.get(view).ok_or_else(|| missing("its buffer view"))?;
    let buffer = buffers.get(view.buffer).and_then(|buffer| buffer.as_ref()).ok_or_else(|| missing("its buffer"))?;
    let stride = view.byte_stride.unwrap_or(size);
    if stride < size || stride > 255 {
        let what = format!("its items are {size} bytes and {stride} bytes apart; export the mesh again");
        return Err(Fault::malformed(place, what));
    }
    let needed = if accessor.count == 0 {
        Some(0)
    } else {
        stride.checked_mul(accessor.count - 1).and_then(|n| n.checked_add(size))
    };
    let bytes = view_bytes(view, buffer).and_then(|bytes| {
        let start = usize::try_from(accessor.byte_offset).ok()?;
        let end = start.checked_add(usize::try_from(needed?).ok()?)?;
        bytes.get(start..end)
    });
    match bytes {
        Some(bytes) => Ok(Items { bytes, stride: stride as usize, count: accessor.count }),
        None => {
            let problem = MeshProblem::AbsurdCount {
                element: "item".to_owned(),
                count: accessor.count,
                bytes: view.byte_length.saturating_sub(accessor.byte_offset),
            };
            Err(Fault::new(place, problem))
        }
    }
}

/// The part of a buffer that a view shows.
fn view_bytes<'b>(view: &View, buffer: &'b [u8]) -> Option<&'b [u8]> {
    let start = usize::try_from(view.byte_offset).ok()?;
    buffer.get(start..start.checked_add(usize::try_from(view.byte_length).ok()?)?)
}
