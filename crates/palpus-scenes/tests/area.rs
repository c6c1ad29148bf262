//! Tests that stiffness does not depend on the number of contacts: a finer mesh of the same surface
//! pushes like the coarse mesh.
//!
//! There are two kinds of refinement, with four and sixteen times the triangles. *Cut* meshes have
//! the same surface, with every triangle divided into four. The forces must not change, however the
//! engine treats coplanar triangles. *Finer* meshes sample the same smooth surface more densely.
//! Then the surface itself moves a little, so forces are divided by the deepest engagement before
//! they are compared. Most of the remaining difference comes from the normals of the facets.

mod bodies;

use std::f64::consts::TAU;
use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose};
use palpus::body::{Body, PolygonSoup};
use palpus::render::{Clustering, ProbeState, Renderer, Settings};
use palpus_scenes::shape::{self, TORUS_MAJOR_RADIUS, TORUS_MINOR_RADIUS};

/// Divides every triangle into four at the middles of its sides.
fn cut_in_four(soup: &PolygonSoup) -> PolygonSoup {
    let mut middles = std::collections::HashMap::new();
    let mut vertices = soup.vertices.clone();
    let mut triangles = Vec::new();
    for f in 0..soup.face_count() {
        let &[a, b, c] = soup.face(f) else { panic!("the soup must consist of triangles") };
        let mut middle = |p: u32, q: u32| {
            *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                vertices.push((vertices[p as usize] + vertices[q as usize]) * 0.5);
                vertices.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    PolygonSoup::from_triangles(vertices, &triangles)
}

/// Returns a closed strip of rings of points, connected by triangles.
fn rings(points: &[Vec<DVec3>]) -> PolygonSoup {
    let sides = points[0].len() as u32;
    let sections = points.len() as u32;
    let mut triangles = Vec::new();
    for k in 0..sections {
        for i in 0..sides {
            let (j, l) = ((i + 1) % sides, (k + 1) % sections);
            let [p, q, r, s] = [k * sides + i, k * sides + j, l * sides + j, l * sides + i];
            triangles.extend([[p, q, r], [p, r, s]]);
        }
    }
    PolygonSoup::from_triangles(points.concat(), &triangles)
}

/// Returns the torus of the scenes with any number of sections and sides.
fn torus(sections: u32, sides: u32) -> PolygonSoup {
    let ring = |k: u32| {
        let radial = DQuat::from_rotation_z(TAU * f64::from(k) / f64::from(sections)) * DVec3::X;
        let on = move |i: u32| {
            let (sin, cos) = (TAU * (f64::from(i) + 0.5) / f64::from(sides)).sin_cos();
            radial * (TORUS_MAJOR_RADIUS + TORUS_MINOR_RADIUS * cos) + DVec3::Z * (TORUS_MINOR_RADIUS * sin)
        };
        (0..sides).map(on).collect::<Vec<_>>()
    };
    rings(&(0..sections).map(ring).collect::<Vec<_>>())
}

/// Returns a plate of 60 mm with waves of `length` and `height` (m), with `cells` cells per side.
fn waves(cells: u32, length: f64, height: f64) -> PolygonSoup {
    let at = |k: u32| 0.06 * (f64::from(k) / f64::from(cells) - 0.5);
    let mut vertices = Vec::new();
    for i in 0..=cells {
        for j in 0..=cells {
            let (x, y) = (at(i), at(j));
            vertices.push(DVec3::new(x, y, height * (TAU * x / length).cos() * (TAU * y / length).cos()));
        }
    }
    let top = vertices.len() as u32;
    for i in 0..=cells {
        for j in 0..=cells {
            vertices.push(DVec3::new(at(i), at(j), -0.01));
        }
    }
    let index = |i: u32, j: u32| i * (cells + 1) + j;
    let mut triangles = Vec::new();
    for i in 0..cells {
        for j in 0..cells {
            let [p, q, r, s] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            triangles.extend([[p, q, r], [p, r, s]]);
            triangles.extend([[top + p, top + r, top + q], [top + p, top + s, top + r]]);
        }
        for (p, q) in [
            (index(i + 1, 0), index(i, 0)),
            (index(i, cells), index(i + 1, cells)),
            (index(0, i), index(0, i + 1)),
            (index(cells, i + 1), index(cells, i)),
        ] {
            triangles.extend([[p, q, top + q], [p, top + q, top + p]]);
        }
    }
    PolygonSoup::from_triangles(vertices, &triangles)
}

/// A motion of a probe over a ground. Both bodies exist with one, four and sixteen times the
/// triangles.
struct Case {
    name: &'static str,
    probes: Vec<Arc<Body>>,
    grounds: Vec<Arc<Body>>,
    /// The pose for s from 0 to 1.
    path: fn(f64) -> Pose,
}

fn case(name: &'static str, probes: &[Arc<Body>], grounds: &[Arc<Body>], path: fn(f64) -> Pose) -> Case {
    Case { name, probes: probes.to_vec(), grounds: grounds.to_vec(), path }
}

/// Returns the depth of the probe, m. The full depth is reached in the second half of the motion.
fn pressed(s: f64, millimetres: f64) -> f64 {
    1e-3 * millimetres * (2.0 * s).min(1.0)
}

fn bodies(soups: impl IntoIterator<Item = PolygonSoup>) -> Vec<Arc<Body>> {
    soups.into_iter().map(|soup| body(&soup)).collect()
}

/// Returns `levels` bodies: the soup, and then each previous body with its triangles divided into
/// four.
fn cuts(soup: PolygonSoup, levels: usize) -> Vec<Arc<Body>> {
    bodies(std::iter::successors(Some(soup), |last| Some(cut_in_four(last))).take(levels))
}

const BALL: f64 = 0.012;
const BLOCK: DVec3 = DVec3::new(0.03, 0.03, 0.01);
const WAVE: f64 = 0.6e-3;

fn laid(s: f64) -> Pose {
    Pose::from_translation(DVec3::new(0.02 * s, 0.01 * s, TORUS_MINOR_RADIUS - pressed(s, 1.0)))
}

fn linked(s: f64) -> Pose {
    let turn = DQuat::from_rotation_y(0.2 * s) * DQuat::from_rotation_x(TAU / 4.0);
    Pose::new(turn, DVec3::new(0.056 + pressed(s, 1.0), 0.002 * s, 0.003 * s))
}

fn in_the_hole(s: f64) -> Pose {
    let out = TORUS_MAJOR_RADIUS - TORUS_MINOR_RADIUS - BALL + pressed(s, 1.0);
    Pose::from_translation(DQuat::from_rotation_z(0.3 * s) * DVec3::X * out)
}

fn block_on_waves(s: f64) -> Pose {
    Pose::from_translation(DVec3::new(0.01 * s, 0.005 * s, BLOCK.z / 2.0 + WAVE - pressed(s, 0.3)))
}

fn ball_on_waves(s: f64) -> Pose {
    Pose::from_translation(DVec3::new(0.01 * s, 0.005 * s, BALL - pressed(s, 0.3)))
}

fn ball_on_table(s: f64) -> Pose {
    Pose::from_translation(DVec3::new(0.02 * s, 0.01 * s, BALL - pressed(s, 1.0)))
}

fn finer(levels: usize) -> Vec<Case> {
    let take = |all: [PolygonSoup; 3]| bodies(all.into_iter().take(levels));
    let tori = take([(50, 20), (100, 40), (200, 80)].map(|(k, n)| torus(k, n)));
    let waves = take([24, 48, 96].map(|cells| waves(cells, 0.02, WAVE)));
    let ripples = take([30, 60, 120].map(|cells| self::waves(cells, 0.006, 0.5 * WAVE)));
    let (table, ball, block) =
        (cuts(shape::table(), 1), cuts(shape::sphere(BALL, 4), 1), cuts(shape::cuboid(BLOCK), 1));
    let balls = take([2, 3, 4].map(|cut| shape::sphere(BALL, cut)));
    vec![
        case("ball on table", &balls, &table, ball_on_table),
        case("ring flat on table", &tori, &table, laid),
        case("ball in ring's hole", &ball, &tori, in_the_hole),
        case("ring in ring", &tori, &tori, linked),
        case("block on waves", &block, &waves, block_on_waves),
        case("ball on waves", &ball, &waves, ball_on_waves),
        case("block on ripples", &block, &ripples, block_on_waves),
    ]
}

fn cut(levels: usize) -> Vec<Case> {
    let (table, block) = (cuts(shape::table(), levels), cuts(shape::cuboid(BLOCK), levels));
    let (tori, scans) = (cuts(torus(50, 20), levels), cuts(shape::scanned_torus(2000), levels));
    let (waves, balls) = (cuts(waves(24, 0.02, WAVE), levels), cuts(shape::sphere(BALL, 2), levels));
    vec![
        case("ball on table", &balls, &table, ball_on_table),
        case("scan flat on table", &scans, &table, laid),
        case("ball in ring's hole", &balls, &tori, in_the_hole),
        case("ring in ring", &tori, &tori, linked),
        case("block on waves", &block, &waves, block_on_waves),
    ]
}

/// Results of one step of a motion.
struct Felt {
    /// Force, N.
    force: DVec3,
    /// Engagement of the deepest contact, m.
    engagement: f64,
    contacts: usize,
}

fn felt(a: &Arc<Body>, b: &Arc<Body>, settings: Settings, path: fn(f64) -> Pose) -> Vec<Felt> {
    const STEPS: u32 = 300;
    let mut renderer = Renderer::new(a.clone(), b.clone(), settings).expect("the settings are valid");
    (0..STEPS)
        .map(|k| {
            let pose = path(f64::from(k) / f64::from(STEPS));
            let tick = renderer.step(&ProbeState::at(pose), 1e-3, &NoClock);
            let engagement = settings.contact_tolerance - tick.separation();
            Felt { force: tick.computed.force, engagement, contacts: tick.contacts.len() }
        })
        .collect()
}

/// Relative change of the force from one level of refinement to the next.
#[derive(Debug)]
struct Change {
    mean: f64,
    worst: f64,
}

fn change(coarse: &[Felt], fine: &[Felt], fairly: bool) -> Change {
    // A shallow contact at the start depends on the exact position of the surface.
    const LEAST: f64 = 0.3e-3;
    let force = |felt: &Felt| if fairly { felt.force / felt.engagement } else { felt.force };
    let both = coarse.iter().zip(fine).filter(|(x, y)| x.engagement.min(y.engagement) > LEAST);
    let changes: Vec<f64> = both.map(|(x, y)| (force(x) - force(y)).length() / force(x).length()).collect();
    assert!(changes.len() > 100, "there must be enough contact");
    Change {
        mean: changes.iter().sum::<f64>() / changes.len() as f64,
        worst: changes.iter().copied().fold(0.0, f64::max),
    }
}

#[allow(clippy::print_stderr, reason = "figures for the record")]
fn assert_alike(cases: &[Case], clustering: Clustering, fairly: bool, mean: f64, worst: f64) {
    let settings = Settings { clustering, ..Settings::default() };
    for Case { name, probes, grounds, path } in cases {
        let levels = probes.len().max(grounds.len());
        let at = |bodies: &[Arc<Body>], level: usize| bodies[level.min(bodies.len() - 1)].clone();
        let all: Vec<_> =
            (0..levels).map(|level| felt(&at(probes, level), &at(grounds, level), settings, *path)).collect();
        for (level, pair) in all.windows(2).enumerate() {
            let change = change(&pair[0], &pair[1], fairly);
            let middle =
                |felt: &[Felt]| (felt[200].contacts, felt[200].force.length() / (800.0 * felt[200].engagement));
            let ((n, k), (m, l)) = (middle(&pair[0]), middle(&pair[1]));
            eprintln!(
                "{name}, {clustering:?}: relative force {k:.2} with {n} contacts, {l:.2} with {m}; force changes by {:.1} % on average, {:.1} % at most",
                100.0 * change.mean,
                100.0 * change.worst
            );
            assert!(change.mean <= mean && change.worst <= worst, "{name}, level {level}: {change:?}");
        }
    }
}

#[test]
fn dividing_triangles_keeps_the_force() {
    assert_alike(&cut(2), Clustering::Smooth, false, 0.01, 0.03);
}

#[test]
fn finer_mesh_gives_similar_force() {
    assert_alike(&finer(2), Clustering::Smooth, true, 0.03, 0.08);
}

#[test]
#[ignore = "takes a minute to prepare sixteen times the triangles"]
fn sixteen_times_the_triangles_give_similar_force() {
    assert_alike(&cut(3), Clustering::Smooth, false, 0.01, 0.03);
    assert_alike(&finer(3), Clustering::Smooth, true, 0.03, 0.08);
}

#[test]
#[ignore = "figures of linkage for the record"]
fn linkage_for_comparison() {
    assert_alike(&finer(3), Clustering::Linkage, true, f64::INFINITY, f64::INFINITY);
}
