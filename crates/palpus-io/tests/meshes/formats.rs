//! Tests that valid files in the dialects of each format are read.

use std::io::Write;

use std::path::PathBuf;

use data_encoding::BASE64;
use glam::DVec3;
use palpus::body::PolygonSoup;
use palpus_io::mesh::{MeshFormat, gltf, obj, off, ply, stl};
use palpus_io::{ContentHash, read_mesh, read_mesh_noting, write_obj_groups};

use crate::samples::{self, loops, prism, triangle_loops};

/// Creates an empty folder for the files of one test.
pub(crate) fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn points(soup: &PolygonSoup, face: usize) -> Vec<[f64; 3]> {
    soup.face(face).iter().map(|&v| soup.vertices[v as usize].to_array()).collect()
}

#[test]
fn all_formats_give_the_same_prism() {
    let prism = prism();
    let folder = folder("every_format");
    for (k, (extension, bytes)) in samples::all(&prism).into_iter().enumerate() {
        let expected = if matches!(extension, "stl" | "gltf" | "glb") { triangle_loops(&prism) } else { loops(&prism) };
        for name in [format!("{k}.{extension}"), format!("{k}.{}", extension.to_uppercase()), format!("{k}")] {
            let path = folder.join(name);
            std::fs::write(&path, &bytes).unwrap();
            let soup = read_mesh(&path).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(loops(&soup), expected, "{}", path.display());
        }
    }
}

#[test]
fn gzip_files_are_decompressed() {
    let prism = prism();
    let folder = folder("packed");
    for (k, (extension, bytes)) in samples::all(&prism).into_iter().enumerate() {
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packer.write_all(&bytes).unwrap();
        let packed = packer.finish().unwrap();
        let plain = folder.join(format!("{k}.{extension}"));
        std::fs::write(&plain, &bytes).unwrap();
        for name in [format!("{k}.{extension}.gz"), format!("packed-{k}")] {
            let path = folder.join(name);
            std::fs::write(&path, &packed).unwrap();
            assert_eq!(loops(&read_mesh(&path).unwrap()), loops(&read_mesh(&plain).unwrap()), "{}", path.display());
        }
        let cut = folder.join(format!("cut-{k}.{extension}.gz"));
        std::fs::write(&cut, &packed[..packed.len() / 2]).unwrap();
        let error = read_mesh(&cut).unwrap_err().to_string();
        assert!(error.contains("compressed content is damaged"), "{error}");
    }
}

#[test]
fn content_determines_the_format() {
    let path = folder("misnamed").join("prism.obj");
    let stl = samples::stl_binary(&prism());
    std::fs::write(&path, &stl).unwrap();
    let mut notes = Vec::new();
    let soup = read_mesh_noting(&path, &mut |note| notes.push(note)).unwrap();
    assert_eq!(loops(&soup), loops(&stl::parse(&stl, "prism.stl").unwrap()));
    assert!(
        notes.len() == 1 && notes[0].ends_with("is named as OBJ, but its content is STL; it was read as STL"),
        "{notes:?}"
    );

    let plain = path.with_extension("stl");
    std::fs::write(&plain, &stl).unwrap();
    read_mesh_noting(&plain, &mut |note| panic!("{note}")).unwrap();
}

#[test]
fn obj_dialects_are_read() {
    let text = b"\xEF\xBB\xBF# caf\xE9 in Latin-1\r\nmtllib /etc/passwd\r\no \xE9t\xE9\r\n\
        v 0 0 0 1.0\r\nv 1 0 0 0.5 0.5 0.5\r\n\tv +1 1. .5e0 # right\r\nv 0 1 -0\r\n\
        vt 0 0\r\nvn 0 0 1\r\ng a b\r\ns off\r\nusemtl x\r\nl 1 2\r\np 1\r\n\
        f 1/1/1 2/1/1 3/1/1 \\\r\n 4/1/1\r\nf -4//1 -3//1 -2//1\r\nf 1/ 2// 5\r\nv 9 9 9\rf 1 2 3 # end";
    let soup = obj::parse(text, "dialects.obj").unwrap();
    assert_eq!(soup.vertices.len(), 5);
    let faces: Vec<&[u32]> = (0..soup.face_count()).map(|f| soup.face(f)).collect();
    assert_eq!(faces, [&[0, 1, 2, 3][..], &[0, 1, 2], &[0, 1, 4], &[0, 1, 2]]);
    assert_eq!(soup.vertices[2], DVec3::new(1.0, 1.0, 0.5));
    assert!(soup.vertices[3].z.is_sign_negative());
}

#[test]
fn ascii_stl_may_have_several_solids_and_capitals() {
    let facet = "FACET NORMAL nan 0 0\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 0 0\nVERTEX 0 1 0\nENDLOOP\nENDFACET\n";
    let text = format!("solid a # one\n{facet}endsolid a\n\nsolid\n{facet}{facet}endsolid\n");
    assert_eq!(stl::parse(text.as_bytes(), "two.stl").unwrap().face_count(), 3);
}

#[test]
fn ply_strips_are_read_and_other_elements_skipped() {
    let text = "ply\r\nformat ascii 1.0\r\nelement camera 1\r\nproperty list uchar float view\r\nelement tristrips 1\r\n\
        property list int int vertex_indices\r\nelement nothing 99999999999\r\nelement vertex 5\r\nproperty double x\r\n\
        property double y\r\nproperty double z\r\nelement tail 3\r\nproperty int t\r\nend_header\r\n\
        2 0.5 1\r\n8 0 1 2 3 -1 2 3 4\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n1 1 0\r\n0 2 0\r\n";
    let soup = ply::parse(text.as_bytes(), "strips.ply").unwrap();
    let faces: Vec<&[u32]> = (0..soup.face_count()).map(|f| soup.face(f)).collect();
    assert_eq!(faces, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
}

#[test]
fn ply_data_may_start_with_a_line_feed() {
    let mut bytes = b"ply\rformat binary_little_endian 1.0\relement face 1\rproperty list uchar uchar vertex_index\r\
        element vertex 10\rproperty uchar x\rproperty uchar y\rproperty uchar z\rend_header\r"
        .to_vec();
    bytes.push(b'\n'); // A face with ten corners: this count equals the code of a line feed.
    bytes.extend(0..10);
    bytes.extend([5; 30]);
    let soup = ply::parse(&bytes, "return.ply").unwrap();
    assert_eq!(soup.face(0), [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
    assert_eq!(soup.vertices[9], DVec3::splat(5.0));
}

#[test]
fn off_dialects_are_read() {
    for text in [
        "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        "COFF\n# colours\n\n3 1\n0 0 0 255 0 0 255\n1 0 0 1 1 1 1\n0 1 0 0 0 0 0 # last\n3 0 1 2 0.5 0.5 0.5",
        "CNOFF\n3 1 3\n0 0 0 0 0 1 9 9 9 9\n1 0 0 0 0 1 9 9 9 9\n0 1 0 0 0 1 9 9 9 9\n\n3 0 1 2\n",
        "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    ] {
        let soup = off::parse(text.as_bytes(), "dialect.off").unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert_eq!((soup.vertices.len(), soup.face_count()), (3, 1));
    }
}

#[test]
fn gltf_transforms_apply_and_reflections_reverse_triangles() {
    let prism = prism();
    let turned = r#", "rotation": [0, 0, 0.7071067811865476, 0.7071067811865476], "translation": [1, 2, 3], "scale": [-2, 1, 1]"#;
    let json = samples::gltf_json(&prism, "", turned)
        .replace(r#"{"children": [1]}"#, r#"{"children": [1], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 10,20,30,1]}"#);
    let soup = gltf::parse(&samples::glb_of(&json, &samples::gltf_buffer(&prism)), "placed.glb").unwrap();
    let expected = triangle_loops(&prism);
    for f in 0..soup.face_count() {
        let [a, b, c] = [0, 2, 1].map(|k| expected[f][k]).map(|p| DVec3::new(11.0 - p.y, 22.0 - 2.0 * p.x, 33.0 + p.z));
        for (corner, expected) in points(&soup, f).into_iter().zip([a, b, c]) {
            assert!((DVec3::from_array(corner) - expected).length() < 1e-12, "face {f}: {corner:?} {expected:?}");
        }
    }
}

#[test]
fn gltf_strips_fans_and_lists_need_no_indices() {
    let buffer: Vec<u8> =
        [0f32, 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.].iter().flat_map(|x| x.to_le_bytes()).collect();
    let uri = BASE64.encode(&buffer);
    for (mode, faces) in [(5, vec![[0, 1, 2], [1, 3, 2]]), (6, vec![[1, 2, 0], [2, 3, 0]])] {
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "mode": {mode}}}, {{"attributes": {{"POSITION": 0}}, "mode": 1}}]}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 48}}],
            "buffers": [{{"byteLength": 48, "uri": "data:;base64,{uri}"}}]}}"#
        );
        let soup = gltf::parse(json.as_bytes(), "mode.gltf").unwrap();
        let found: Vec<&[u32]> = (0..soup.face_count()).map(|f| soup.face(f)).collect();
        assert_eq!(found, faces, "mode {mode}");
    }
}

#[test]
fn gltf_reads_only_files_in_its_folder() {
    let prism = prism();
    let folder = folder("beside");
    std::fs::write(folder.join("the data.bin"), samples::gltf_buffer(&prism)).unwrap();
    let path = folder.join("prism.gltf");
    std::fs::write(&path, samples::gltf_json(&prism, r#", "uri": "the%20data.bin""#, "")).unwrap();
    assert_eq!(loops(&read_mesh(&path).unwrap()), triangle_loops(&prism));
    for uri in ["../beside/the data.bin", "/etc/passwd", "file:///etc/passwd", "%2e%2e/beside/the data.bin"] {
        std::fs::write(&path, samples::gltf_json(&prism, &format!(r#", "uri": "{uri}""#), "")).unwrap();
        let error = read_mesh(&path).unwrap_err().to_string();
        assert!(error.contains("buffer 0") && error.contains("outside the mesh file's folder"), "{error}");
    }
}

#[test]
fn written_obj_groups_are_read_back_exactly() {
    let mut first = prism();
    first.vertices[1] = DVec3::new(0.1 + 0.2, -0.0, 1e-300);
    first.vertices[2] = DVec3::new(1.0 / 3.0, 1e29, 5e-324);
    let mut out = Vec::new();
    write_obj_groups(&mut out, [("piece 0", first.clone()), ("piece 1", prism())]).unwrap();
    let text = String::from_utf8(out.clone()).unwrap();
    assert!(text.starts_with("g piece_0\nv 0.0 0.0 0.0\nv 0.30000000000000004 -0.0 1e-300\n"), "{text}");
    let soup = obj::parse(&out, "pieces.obj").unwrap();
    let bits = |soup: &PolygonSoup| {
        loops(soup).concat().into_iter().map(|v| v.to_array().map(f64::to_bits)).collect::<Vec<_>>()
    };
    assert_eq!(bits(&soup), [bits(&first), bits(&prism())].concat());
}

#[test]
fn content_hash_depends_only_on_the_mesh() {
    let prism = prism();
    let hash = ContentHash::of_soup(&prism);
    assert_eq!(ContentHash::of_soup(&obj::parse(&samples::obj(&prism), "a.obj").unwrap()), hash);
    let mut other = prism.clone();
    other.vertices[0].x = -0.0;
    assert_ne!(ContentHash::of_soup(&other), hash);
    let mut other = prism;
    other.face_vertices.swap(0, 1);
    assert_ne!(ContentHash::of_soup(&other), hash);
    assert_eq!(hash.to_string().parse(), Ok(hash));
    assert!("xyz".parse::<ContentHash>().is_err());
}

#[test]
fn formats_are_recognised_by_first_bytes() {
    for (text, format) in [
        (&b"# comment\nv 0 0 0"[..], Some(MeshFormat::Obj)),
        (b"ply\nformat", Some(MeshFormat::Ply)),
        (b" {\"asset\"", Some(MeshFormat::Gltf)),
        (b"NOFF\n", Some(MeshFormat::Off)),
        (b"solid x\n", Some(MeshFormat::Stl)),
        (b"hello", None),
    ] {
        assert_eq!(MeshFormat::of_content(text), format, "{}", text.escape_ascii());
    }
}
