//! Compares convex hulls with SciPy's Qhull, on the point sets in `fixtures/hulls`. The script
//! `fixtures/make_hulls.py` makes these files.

use std::{fs, path::Path};

use glam::DVec3;
use palpus::body::{Hull, Polytope, convex_hull};

struct Fixture {
    solid: bool,
    coplanar: f64,
    volume: f64,
    area: f64,
    extreme: usize,
    points: Vec<DVec3>,
}

fn read(path: &Path) -> Fixture {
    let mut fixture = Fixture { solid: false, coplanar: 0.0, volume: 0.0, area: 0.0, extreme: 0, points: Vec::new() };
    for line in fs::read_to_string(path).unwrap().lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |k: usize| words[k].parse::<f64>().unwrap();
        match words[0] {
            "kind" => fixture.solid = words[1] == "solid",
            "coplanar" => fixture.coplanar = number(1),
            "volume" => fixture.volume = number(1),
            "area" => fixture.area = number(1),
            "extreme" => fixture.extreme = words[1].parse().unwrap(),
            "point" => fixture.points.push(DVec3::new(number(1), number(2), number(3))),
            other => panic!("{}: unknown line {other}", path.display()),
        }
    }
    fixture
}

/// Returns the volume and the area of all faces. For a plate, returns the area of the front.
fn measure(polytope: &Polytope) -> (f64, f64) {
    let origin = polytope.centroid();
    let (mut volume, mut area) = (0.0, 0.0);
    let faces = if polytope.is_flat() { 1 } else { polytope.face_count() };
    for f in 0..faces as u32 {
        let corners: Vec<DVec3> = polytope.face_vertices(f).iter().map(|v| polytope.vertex(v) - origin).collect();
        for side in corners[1..].windows(2) {
            volume += corners[0].dot(side[0].cross(side[1])) / 6.0;
            area += (side[0] - corners[0]).cross(side[1] - corners[0]).length() / 2.0;
        }
    }
    (volume, area)
}

#[test]
fn volume_area_and_vertex_count_match_qhull() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/hulls");
    let mut paths: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert!(paths.len() >= 13, "fixtures are missing from {}", folder.display());
    for path in paths {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let fixture = read(&path);
        let hull = convex_hull(&fixture.points, fixture.coplanar).unwrap();
        assert_eq!(matches!(hull, Hull::Solid { .. }), fixture.solid, "{name}");
        let (polytope, inputs) = hull.into_polytope().unwrap();
        assert_eq!(polytope.validate(fixture.coplanar), Ok(()), "{name}");
        for (v, &k) in inputs.iter().enumerate() {
            assert_eq!(polytope.vertex(v as u32), fixture.points[k as usize], "{name}");
        }
        let (volume, area) = measure(&polytope);
        // Merging may remove a layer of up to the merge distance from the surface. The rounding
        // errors of Qhull are much smaller.
        let volume_slack = 2.0 * fixture.coplanar * fixture.area;
        let volume_slack = if fixture.solid { volume_slack } else { f64::INFINITY };
        assert!(
            (volume - fixture.volume).abs() <= volume_slack,
            "{name}: volume {volume}, Qhull has {}",
            fixture.volume
        );
        assert!((area / fixture.area - 1.0).abs() <= 1e-6, "{name}: area {area}, Qhull has {}", fixture.area);
        if fixture.extreme > 0 {
            assert_eq!(polytope.vertices().len(), fixture.extreme, "{name}");
        }
    }
}
