//! A small solid in every format, written by code that has nothing in common with the readers.

use data_encoding::BASE64;
use glam::DVec3;
use palpus::body::PolygonSoup;

/// Returns a triangular prism of two triangles and three quadrilaterals. The coordinates are exact
/// in f32.
pub(crate) fn prism() -> PolygonSoup {
    let mut soup = PolygonSoup::new();
    for z in [0.0, 2.5] {
        for (x, y) in [(0.0, 0.0), (1.0, 0.25), (-0.5, 3.0)] {
            soup.vertices.push(DVec3::new(x, y, z));
        }
    }
    for face in [&[2, 1, 0][..], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]] {
        soup.push_face(face);
    }
    soup
}

/// Returns the corners of all faces as points. A reader must keep these points, but may share
/// vertices.
pub(crate) fn loops(soup: &PolygonSoup) -> Vec<Vec<DVec3>> {
    (0..soup.face_count()).map(|f| soup.face(f).iter().map(|&v| soup.vertices[v as usize]).collect()).collect()
}

/// Returns the faces of the prism, split into fans of triangles.
pub(crate) fn triangles(soup: &PolygonSoup) -> Vec<[u32; 3]> {
    let fan = |f: &[u32]| (1..f.len() - 1).map(|k| [f[0], f[k], f[k + 1]]).collect::<Vec<_>>();
    (0..soup.face_count()).flat_map(|f| fan(soup.face(f))).collect()
}

/// Returns the corners of the triangles as points.
pub(crate) fn triangle_loops(soup: &PolygonSoup) -> Vec<Vec<DVec3>> {
    triangles(soup).iter().map(|t| t.iter().map(|&v| soup.vertices[v as usize]).collect()).collect()
}

pub(crate) fn obj(soup: &PolygonSoup) -> Vec<u8> {
    let mut text = String::from("# prism\nmtllib none.mtl\no prism\n");
    soup.vertices.iter().for_each(|v| text += &format!("v {} {} {}\n", v.x, v.y, v.z));
    for f in 0..soup.face_count() {
        text += "f";
        soup.face(f).iter().for_each(|v| text += &format!(" {}", v + 1));
        text += "\n";
    }
    text.into_bytes()
}

pub(crate) fn off(soup: &PolygonSoup) -> Vec<u8> {
    let mut text = format!("OFF\n# prism\n{} {} 0\n", soup.vertices.len(), soup.face_count());
    soup.vertices.iter().for_each(|v| text += &format!("{} {} {}\n", v.x, v.y, v.z));
    for f in 0..soup.face_count() {
        text += &soup.face(f).len().to_string();
        soup.face(f).iter().for_each(|v| text += &format!(" {v}"));
        text += " 255 0 0\n";
    }
    text.into_bytes()
}

pub(crate) fn stl_ascii(soup: &PolygonSoup) -> Vec<u8> {
    let mut text = String::from("solid prism of 5\n");
    for triangle in triangles(soup) {
        text += " facet normal 0 0 0\n  outer loop\n";
        for v in triangle {
            let v = soup.vertices[v as usize];
            text += &format!("   vertex {:e} {} {}\n", v.x, v.y, v.z);
        }
        text += "  endloop\n endfacet\n";
    }
    (text + "endsolid prism\n").into_bytes()
}

pub(crate) fn stl_binary(soup: &PolygonSoup) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes[..5].copy_from_slice(b"solid");
    let triangles = triangles(soup);
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        for v in triangle {
            soup.vertices[v as usize].to_array().iter().for_each(|&x| bytes.extend((x as f32).to_le_bytes()));
        }
        bytes.extend([7, 0]);
    }
    bytes
}

/// Writes a PLY file; `format` is `ascii`, `binary_little_endian` or `binary_big_endian`.
pub(crate) fn ply(soup: &PolygonSoup, format: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment prism\nelement vertex {}\nproperty float x\nproperty uchar red\n\
         property double y\nproperty float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        soup.vertices.len(),
        soup.face_count()
    )
    .into_bytes();
    let big = format == "binary_big_endian";
    let order = |little: &[u8]| if big { little.iter().rev().copied().collect::<Vec<u8>>() } else { little.to_vec() };
    for v in &soup.vertices {
        if format == "ascii" {
            bytes.extend(format!("{} 9 {} {}\n", v.x, v.y, v.z).into_bytes());
            continue;
        }
        bytes.extend(order(&(v.x as f32).to_le_bytes()));
        bytes.push(9);
        bytes.extend(order(&v.y.to_le_bytes()));
        bytes.extend(order(&(v.z as f32).to_le_bytes()));
    }
    for f in 0..soup.face_count() {
        let face = soup.face(f);
        if format == "ascii" {
            bytes.extend(face.len().to_string().into_bytes());
            face.iter().for_each(|v| bytes.extend(format!(" {v}").into_bytes()));
            bytes.push(b'\n');
            continue;
        }
        bytes.push(face.len() as u8);
        face.iter().for_each(|v| bytes.extend(order(&(*v as i32).to_le_bytes())));
    }
    bytes
}

/// Returns the bytes of a buffer: the positions, followed by 16-bit indices.
pub(crate) fn gltf_buffer(soup: &PolygonSoup) -> Vec<u8> {
    let mut bytes = Vec::new();
    for v in &soup.vertices {
        v.to_array().iter().for_each(|&x| bytes.extend((x as f32).to_le_bytes()));
    }
    triangles(soup).iter().flatten().for_each(|&v| bytes.extend((v as u16).to_le_bytes()));
    bytes
}

/// Returns a glTF document. `buffer` contains JSON members of its buffer (such as `"uri": …`), and
/// `node` contains JSON members of its node.
pub(crate) fn gltf_json(soup: &PolygonSoup, buffer: &str, node: &str) -> String {
    let positions = 12 * soup.vertices.len();
    let indices = 3 * triangles(soup).len();
    let length = positions + 2 * indices;
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
  "nodes": [{{"children": [1]}}, {{"mesh": 0{node}}}],
  "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "NORMAL": 7}}, "indices": 1}}]}}],
  "accessors": [{{"bufferView": 0, "componentType": 5126, "count": {}, "type": "VEC3"}},
    {{"bufferView": 1, "componentType": 5123, "count": {indices}, "type": "SCALAR"}}],
  "bufferViews": [{{"buffer": 0, "byteLength": {positions}}},
    {{"buffer": 0, "byteOffset": {positions}, "byteLength": {}}}],
  "buffers": [{{"byteLength": {length}{buffer}}}]}}"#,
        soup.vertices.len(),
        2 * indices
    )
}

pub(crate) fn gltf_embedded(soup: &PolygonSoup) -> Vec<u8> {
    let uri = format!(r#", "uri": "data:application/octet-stream;base64,{}""#, BASE64.encode(&gltf_buffer(soup)));
    gltf_json(soup, &uri, "").into_bytes()
}

pub(crate) fn glb_of(json: &str, buffer: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut buffer = buffer.to_vec();
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", buffer)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

pub(crate) fn glb(soup: &PolygonSoup) -> Vec<u8> {
    glb_of(&gltf_json(soup, "", ""), &gltf_buffer(soup))
}

/// Returns the solid in every format, with the file extension.
pub(crate) fn all(soup: &PolygonSoup) -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("obj", obj(soup)),
        ("off", off(soup)),
        ("stl", stl_ascii(soup)),
        ("stl", stl_binary(soup)),
        ("ply", ply(soup, "ascii")),
        ("ply", ply(soup, "binary_little_endian")),
        ("ply", ply(soup, "binary_big_endian")),
        ("gltf", gltf_embedded(soup)),
        ("glb", glb(soup)),
    ]
}
