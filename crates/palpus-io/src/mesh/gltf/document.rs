//! The parts of a glTF document that describe triangles, and the GLB container.

use serde::Deserialize;

use crate::mesh::fault::{Fault, Place};

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Root {
    pub(super) asset: Asset,
    pub(super) scene: Option<usize>,
    #[serde(default)]
    pub(super) scenes: Vec<Scene>,
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    #[serde(default)]
    pub(super) meshes: Vec<Mesh>,
    #[serde(default)]
    pub(super) accessors: Vec<Accessor>,
    #[serde(default)]
    pub(super) buffer_views: Vec<View>,
    #[serde(default)]
    pub(super) buffers: Vec<Buffer>,
    #[serde(default)]
    pub(super) extensions_required: Vec<String>,
}

#[derive(Deserialize)]
pub(super) struct Asset {
    pub(super) version: String,
}

#[derive(Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub(super) nodes: Vec<usize>,
}

/// The transforms are boxed, so that a list of empty nodes does not need a hundred times the
/// memory of its text.
#[derive(Deserialize)]
pub(super) struct Node {
    pub(super) mesh: Option<usize>,
    #[serde(default)]
    pub(super) children: Vec<usize>,
    pub(super) matrix: Option<Box<[f64; 16]>>,
    pub(super) translation: Option<Box<[f64; 3]>>,
    pub(super) rotation: Option<Box<[f64; 4]>>,
    pub(super) scale: Option<Box<[f64; 3]>>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub(super) attributes: Attributes,
    pub(super) indices: Option<usize>,
    pub(super) mode: Option<u32>,
}

#[derive(Deserialize)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    pub(super) position: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: u32,
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) shape: Box<str>,
    pub(super) sparse: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: Option<u64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: u64,
}

/// Returns the JSON chunk and, if present, the binary chunk.
pub(super) fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
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
            format!("GLB version {version} is not supported, only version 2; export it again"),
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

/// Rejects documents with unsupported features.
pub(super) fn check_version_and_extensions(root: &Root) -> Result<(), Fault> {
    if !root.asset.version.starts_with("2.") {
        let what = format!("glTF version {:?} is not supported, only 2.x; export the mesh again", root.asset.version);
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
                "it needs the extension {name:?}, which is not supported; export the mesh without it (no compression)"
            );
            Err(Fault::unsupported(Place::File, what))
        }
    }
}
