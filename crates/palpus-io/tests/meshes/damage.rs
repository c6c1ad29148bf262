//! Damaged files give an error of one sentence and never a panic.

use palpus::body::PolygonSoup;
use palpus_io::MeshFileError;
use palpus_io::mesh::{gltf, obj, off, ply, stl};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

use crate::samples::{self, prism};

type Parse = fn(&[u8], &str) -> Result<PolygonSoup, MeshFileError>;

const PARSERS: [Parse; 5] = [obj::parse, stl::parse, ply::parse, off::parse, gltf::parse];

/// Seed of all random tests in this file.
const SEED: [u8; 32] = *b"palpus-io damaged mesh files 001";

fn runner(cases: u32) -> TestRunner {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &SEED))
}

/// Returns the parser for an extension.
fn parser(extension: &str) -> Parse {
    match extension {
        "obj" => obj::parse,
        "stl" => stl::parse,
        "ply" => ply::parse,
        "off" => off::parse,
        _ => gltf::parse,
    }
}

/// Checks the invariants of a soup.
fn check(soup: &PolygonSoup) {
    assert!(soup.vertices.iter().all(|v| v.is_finite()));
    assert!(soup.face_vertices.iter().all(|&v| (v as usize) < soup.vertices.len()));
    assert!(soup.face_count() > 0 && (0..soup.face_count()).all(|f| soup.face(f).len() >= 3));
    assert_eq!(soup.face_starts.last(), Some(&(soup.face_vertices.len() as u32)));
}

/// Checks the invariants of an error.
fn check_error(error: &MeshFileError) {
    let text = error.to_string();
    assert!(text.starts_with("x") && !text.contains('\n') && text.len() < 400, "{text}");
}

#[test]
fn random_bytes_never_panic() {
    let words = prop::sample::select(vec![
        &b"v 1 2 3\n"[..],
        b"f 1 2 3\n",
        b"f -1 -2 -3",
        b"\n",
        b" ",
        b"1",
        b"4294967296",
        b"-7",
        b"nan",
        b"\xFF",
        b"\0\0\0",
        b"OFF\n",
        b"ply\n",
        b"format ascii 1.0\n",
        b"format binary_little_endian 1.0\n",
        b"element vertex 3\n",
        b"element face 1\n",
        b"property list uchar int vertex_index\n",
        b"property float x\n",
        b"property float y\n",
        b"property float z\n",
        b"end_header\n",
        b"solid\n",
        b"facet\n",
        b"outer loop\n",
        b"vertex 0 1 2\n",
        b"endloop\n",
        b"endfacet\n",
        b"endsolid\n",
        b"glTF",
        b"\x02\0\0\0",
        b"JSON",
        b"{",
        b"}",
        b"\"asset\":",
        b"#",
        b"\\\n",
        b"\r",
    ]);
    let strategy = prop_oneof![
        prop::collection::vec(any::<u8>(), 0..300),
        prop::collection::vec(words, 0..40).prop_map(|words| words.concat()),
    ];
    let run = runner(2000).run(&strategy, |bytes| {
        for parse in PARSERS {
            match parse(&bytes, "x") {
                Ok(soup) => check(&soup),
                Err(error) => check_error(&error),
            }
        }
        Ok(())
    });
    run.unwrap_or_else(|failure| panic!("seed {}: {failure}", SEED.escape_ascii()));
}

#[test]
fn damaged_files_never_panic() {
    let files = samples::all(&prism());
    let byte = prop_oneof![any::<u8>(), prop::sample::select(b"0123456789-.eE \n/\"{}[],:\xFF\0".to_vec())];
    let edits = prop::collection::vec((any::<prop::sample::Index>(), byte, 0..4u8), 1..6);
    let run = runner(4000).run(&(0..files.len(), edits, any::<prop::sample::Index>()), |(file, edits, cut)| {
        let (extension, mut bytes) = files[file].clone();
        for (at, byte, kind) in edits {
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                2 if bytes.len() > 1 => drop(bytes.remove(at)),
                _ => bytes.truncate((at + 1).max(cut.index(bytes.len()))),
            }
        }
        match parser(extension)(&bytes, "x") {
            Ok(soup) => check(&soup),
            Err(error) => check_error(&error),
        }
        Ok(())
    });
    run.unwrap_or_else(|failure| panic!("seed {}: {failure}", SEED.escape_ascii()));
}

/// Returns the ranges of all sequences of digits in a text.
fn numbers(bytes: &[u8]) -> Vec<std::ops::Range<usize>> {
    let is_start = |at: usize| bytes[at].is_ascii_digit() && (at == 0 || !bytes[at - 1].is_ascii_digit());
    let end = |at: usize| at + bytes[at..].iter().take_while(|b| b.is_ascii_digit()).count();
    (0..bytes.len()).filter(|&at| is_start(at)).map(|at| at..end(at)).collect()
}

#[test]
fn absurd_numbers_never_panic() {
    let absurd =
        ["", "-1", "0", "255", "65536", "4294967295", "9223372036854775807", "18446744073709551615", "1e308", "99e999"];
    for (extension, bytes) in samples::all(&prism()) {
        // The length of the GLB container's JSON is kept, so that the reader parses the changed
        // number.
        let glb = bytes.starts_with(b"glTF");
        for place in numbers(&bytes) {
            for number in absurd.map(str::as_bytes) {
                let mut damaged = [&bytes[..place.start], number, &bytes[place.end..]].concat();
                if glb {
                    let json = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
                    let longer = json + number.len() - place.len();
                    damaged[12..16].copy_from_slice(&(longer as u32).to_le_bytes());
                    damaged.resize(damaged.len().max(bytes.len()), 0);
                }
                match parser(extension)(&damaged, "x") {
                    Ok(soup) => check(&soup),
                    Err(error) => check_error(&error),
                }
            }
        }
    }
}

#[test]
fn truncated_binary_files_are_detected() {
    for (extension, bytes) in samples::all(&prism()) {
        let is_text = bytes.is_ascii() && !bytes.starts_with(b"glTF") && bytes.iter().all(|&b| b != 0);
        for length in 0..bytes.len() {
            match parser(extension)(&bytes[..length], "x") {
                // A text file may lose a colour, a name or a line break at its end without losing a
                // face.
                Ok(soup) => assert!(is_text, "{extension} cut at {length}: {} faces", soup.face_count()),
                Err(error) => check_error(&error),
            }
        }
    }
}

#[test]
fn extreme_coordinates_survive_a_round_trip() {
    let coordinate = prop_oneof![-1e6..1e6f64, prop::num::f64::NORMAL.prop_filter("in range", |x| x.abs() < 1e30)];
    let strategy = prop::collection::vec([coordinate.clone(), coordinate.clone(), coordinate], 3..9);
    let run = runner(500).run(&strategy, |vertices| {
        let mut soup = PolygonSoup::new();
        soup.vertices = vertices.into_iter().map(glam::DVec3::from_array).collect();
        let loop_: Vec<u32> = (0..soup.vertices.len() as u32).collect();
        soup.push_face(&loop_);
        soup.push_face(&[2, 1, 0]);
        prop_assert_eq!(&obj::parse(&samples::obj(&soup), "x").unwrap(), &soup);
        prop_assert_eq!(&off::parse(&samples::off(&soup), "x").unwrap(), &soup);
        let mut written = Vec::new();
        palpus_io::write_obj_groups(&mut written, [("x", soup.clone())]).unwrap();
        prop_assert_eq!(&obj::parse(&written, "x").unwrap(), &soup);
        Ok(())
    });
    run.unwrap_or_else(|failure| panic!("seed {}: {failure}", SEED.escape_ascii()));
}

/// Files and their complete error messages.
#[test]
fn errors_name_problem_place_and_remedy() {
    let mut nan = samples::stl_binary(&prism());
    nan[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut absurd = samples::stl_binary(&prism());
    absurd[80..84].copy_from_slice(&[0xFF; 4]);
    absurd[0] = b'x';
    let mut ply_index = samples::ply(&prism(), "binary_little_endian");
    let last = ply_index.len() - 4;
    ply_index[last..].copy_from_slice(&77i32.to_le_bytes());
    let ply_absurd =
        String::from_utf8(samples::ply(&prism(), "ascii")).unwrap().replace("vertex 6", "vertex 999999999999");
    let gltf = |from: &str, to: &str| String::from_utf8(samples::gltf_embedded(&prism())).unwrap().replace(from, to);
    let cases: Vec<(Parse, Vec<u8>, &str)> = vec![
        (
            obj::parse,
            b"v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n".to_vec(),
            "x, line 3: coordinate \"nan\" is not a finite number; repair the vertex or export the mesh again",
        ),
        (
            obj::parse,
            b"v 0 0 1e999\n".to_vec(),
            "x, line 1: coordinate \"1e999\" is not a finite number; repair the vertex or export the mesh again",
        ),
        (
            obj::parse,
            b"v 0 0 -1e31\n".to_vec(),
            "x, line 1: coordinate -1e31 is too large (the limit is 1e30); repair the vertex or export the mesh again",
        ),
        (
            obj::parse,
            b"v 0 0\n".to_vec(),
            "x, line 1: a vertex has 2 coordinates and needs 3; repair it or export the mesh again",
        ),
        (obj::parse, b"v 0,5 0 0\n".to_vec(), "x, line 1: \"0,5\" is not a number; use a decimal point"),
        (
            obj::parse,
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 7\nf 1 2 9\n".to_vec(),
            "x, line 5: the face refers to vertex 7, but the file has 3 vertices, counted from 1; \
          the file is damaged or truncated: export the mesh again",
        ),
        (
            obj::parse,
            b"v 0 0 0\nf 0 1 1\n".to_vec(),
            "x, line 2: the face refers to vertex 0, but the file has 1 vertices, counted from 1; \
          the file is damaged or truncated: export the mesh again",
        ),
        (
            obj::parse,
            b"v 0 0 0\nf -1 -2 1\n".to_vec(),
            "x, line 2: the face refers to vertex -2, but the file has 1 vertices, counted from 1; \
          the file is damaged or truncated: export the mesh again",
        ),
        (
            obj::parse,
            b"v 0 0 0\nf 1 a 1\n".to_vec(),
            "x, line 2: \"a\" is not the corner of a face (v, v/vt, v//vn or v/vt/vn); repair it or export the mesh again",
        ),
        (
            obj::parse,
            b"v 0 0 0\nvw 1 2 3\n".to_vec(),
            "x, line 2: \"vw\" is not an OBJ statement; repair or remove the line",
        ),
        (obj::parse, b"\xFF\xFEv\0".to_vec(), "x: the text is UTF-16; save it as UTF-8 or ASCII"),
        (
            stl::parse,
            nan,
            "x, triangle 1: coordinate \"NaN\" is not a finite number; repair the vertex or export the mesh again",
        ),
        (
            stl::parse,
            absurd,
            "x, triangle 8: the file's triangle count is 4294967295, more than its remaining 400 bytes can contain; \
          it is damaged or truncated: copy or export it again",
        ),
        (
            stl::parse,
            b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n".to_vec(),
            "x, line 4: the file ends inside a facet; it is truncated: copy or export it again",
        ),
        (
            stl::parse,
            b"solid a\nvertex 0 0 0\n".to_vec(),
            "x, line 2: \"vertex\" was found where `facet` or `endsolid` is expected; the file is damaged: export the mesh again",
        ),
        (
            ply::parse,
            ply_index,
            "x, face 4: the face refers to vertex 77, but the file has 6 vertices, counted from 0; \
          the file is damaged or truncated: export the mesh again",
        ),
        (
            ply::parse,
            ply_absurd.into_bytes(),
            "x: the file's vertex count is 999999999999, more than its remaining 112 bytes can contain; \
          it is damaged or truncated: copy or export it again",
        ),
        (
            off::parse,
            b"OFF\n3 1 0\n0 0 0\n0 1 0\n1 0 0\n2 0 1\n".to_vec(),
            "x, line 6: a face has 2 corners and needs at least 3; remove the face or export the mesh again",
        ),
        (
            off::parse,
            b"OFF BINARY\n".to_vec(),
            "x, line 1: only ASCII OFF files with three coordinates are supported; export the mesh as ASCII OFF or PLY",
        ),
        (
            gltf::parse,
            gltf("\"asset\"", "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"], \"asset\"").into_bytes(),
            "x: it needs the extension \"KHR_draco_mesh_compression\", which is not supported; export the mesh without it (no compression)",
        ),
        (
            gltf::parse,
            gltf("5123", "5126").into_bytes(),
            "x, accessor 1: component type 5126 cannot be used here; export the mesh again",
        ),
        (
            gltf::parse,
            gltf("\"count\": 6,", "\"count\": 600000000,").into_bytes(),
            "x, accessor 0: the file's item count is 600000000, more than its remaining 72 bytes can contain; \
          it is damaged or truncated: copy or export it again",
        ),
        (
            gltf::parse,
            gltf("\"children\": [1]", "\"children\": [1, 0]").into_bytes(),
            "x, node 0: node 0 is reached twice, but nodes must form trees; export the mesh again",
        ),
        (
            gltf::parse,
            b"{\n \"asset\": }".to_vec(),
            "x, line 2: the JSON is invalid: expected value at line 2 column 11; export the mesh again",
        ),
        (
            gltf::parse,
            b"glTF\x02\0\0\0\x04\0\0\0".to_vec(),
            "x: the file ends before its JSON chunk; it is truncated: copy or export it again",
        ),
    ];
    for (parse, bytes, expected) in cases {
        let text = parse(&bytes, "x").map(|_| ()).unwrap_err().to_string();
        assert_eq!(text, expected);
    }
}
