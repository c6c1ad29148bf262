//! What a mesh is like: closed or open, manifold, self-intersecting, inverted; and what was done to make it a mesh.
//!
//! 1. Edges: used by one triangle (boundary), by three or more (non-manifold), or by two that disagree.
//! 2. Vertices whose triangles form more than one fan are *pinched*: parts of the surface touch there.
//! 3. Components: closed or open, and the genus of closed ones by Euler's formula, pinched vertices taken apart.
//! 4. Self-intersections: pairs of triangles that cross, overlap in a plane or touch, by exact tests of all pairs whose
//!    boxes overlap. The number of tests is bounded.
//! 5. All of it once more in plain words ([`Notice`]).

use std::fmt;
use std::ops::ControlFlow;

use super::half_edge::EdgeUses;
use super::{Cleaning, HalfEdges, Mesh, TrianglePair, TriangleTree};
use crate::algebra::tolerance;

/// What a mesh is like.
#[derive(Clone, Debug, PartialEq)]
pub struct Health {
    /// What was done to make a mesh of the file.
    pub cleaning: Cleaning,
    /// Each component, in the order of its first triangle.
    pub components: Vec<ComponentHealth>,
    /// Edges that a single triangle uses.
    pub boundary_edges: usize,
    /// Edges that three or more triangles use.
    pub non_manifold_edges: usize,
    /// Edges of two triangles that disagree about which side is outside.
    pub disagreeing_edges: usize,
    /// Vertices at which parts of the surface touch that share no edge there.
    pub pinched_vertices: usize,
    /// Each edge is used as often in either direction: the surface has no boundary.
    pub closed: bool,
    /// `None` when they were not looked for.
    pub self_intersections: Option<SelfIntersections>,
}

/// What one component is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComponentHealth {
    /// Number of triangles.
    pub triangles: usize,
    /// No boundary within the component, and its triangles agree.
    pub closed: bool,
    /// Number of handles; known when each edge of the component has exactly two triangles that agree.
    pub genus: Option<usize>,
}

/// Pairs of triangles that have more in common than a mesh's neighbours may.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SelfIntersections {
    /// Pairs whose interiors cross.
    pub crossing_pairs: usize,
    /// Pairs that lie in one plane and overlap there.
    pub overlapping_pairs: usize,
    /// Pairs that touch beyond what they share, without crossing: a T-junction, or parts laid against each other.
    pub touching_pairs: usize,
    /// Triangles that take part in a crossing or an overlap.
    pub triangles: usize,
    /// All pairs were tested; if not, the counts are lower bounds.
    pub complete: bool,
}

impl SelfIntersections {
    /// Tests the mesh's own pairs of triangles, up to [`tolerance::SELF_PAIRS`] times as many as there are triangles.
    pub fn count(mesh: &Mesh, tree: &TriangleTree) -> Self {
        let mut answer = Self { complete: true, ..Self::default() };
        let mut involved = vec![false; mesh.triangles().len()];
        let mut left = tolerance::SELF_PAIRS.saturating_mul(mesh.triangles().len());
        let _ = tree.visit_own_pairs(|(first, first_corners), (second, second_corners)| {
            if left == 0 {
                answer.complete = false;
                return ControlFlow::Break(());
            }
            left -= 1;
            match TrianglePair::new(*first_corners, *second_corners) {
                TrianglePair::Apart => return ControlFlow::Continue(()),
                TrianglePair::Touching => {
                    answer.touching_pairs += 1;
                    return ControlFlow::Continue(());
                }
                TrianglePair::Crossing => answer.crossing_pairs += 1,
                TrianglePair::CoplanarOverlap => answer.overlapping_pairs += 1,
            }
            (involved[first as usize], involved[second as usize]) = (true, true);
            ControlFlow::Continue(())
        });
        answer.triangles = involved.iter().filter(|&&involved| involved).count();
        answer
    }

    /// Any crossing or overlap?
    pub fn any(&self) -> bool {
        self.crossing_pairs + self.overlapping_pairs > 0
    }
}

impl Health {
    /// Everything but self-intersections, in linear time.
    pub fn quick(mesh: &Mesh, edges: &HalfEdges, cleaning: Cleaning) -> Self {
        let mut health = Self {
            cleaning,
            components: Vec::new(),
            boundary_edges: 0,
            non_manifold_edges: 0,
            disagreeing_edges: 0,
            pinched_vertices: 0,
            closed: mesh.is_closed(),
            self_intersections: None,
        };
        let mut branched = vec![false; mesh.vertices().len()];
        for uses in EdgeUses::new(mesh.vertices().len(), mesh.triangles()).edges() {
            let (t, k) = (uses[0] / 3, (uses[0] % 3) as usize);
            match uses.len() {
                1 => health.boundary_edges += 1,
                2 if edges.neighbour(t, k).is_some() => continue,
                2 => health.disagreeing_edges += 1,
                _ => health.non_manifold_edges += 1,
            }
            if uses.len() > 1 {
                let triangle = mesh.triangles()[t as usize];
                (branched[triangle[k] as usize], branched[triangle[(k + 1) % 3] as usize]) = (true, true);
            }
        }
        let fans = Fans::new(mesh, edges);
        health.pinched_vertices =
            fans.at_vertex.iter().zip(&branched).filter(|&(&fans, &branched)| fans > 1 && !branched).count();
        health.components = components(mesh, edges, &fans);
        health
    }

    /// Everything, self-intersections included.
    pub fn full(mesh: &Mesh, edges: &HalfEdges, tree: &TriangleTree, cleaning: Cleaning) -> Self {
        Self { self_intersections: Some(SelfIntersections::count(mesh, tree)), ..Self::quick(mesh, edges, cleaning) }
    }

    /// Each edge has one or two triangles, which agree, and no vertex is pinched.
    pub fn is_manifold(&self) -> bool {
        self.non_manifold_edges + self.disagreeing_edges + self.pinched_vertices == 0
    }

    /// Number of handles of all components together, when the surface is closed and manifold.
    pub fn genus(&self) -> Option<usize> {
        if self.closed && self.is_manifold() { self.components.iter().map(|c| c.genus).sum() } else { None }
    }

    /// All that a user should know, the most consequential first.
    pub fn notices(&self) -> Vec<Notice> {
        let cleaning = &self.cleaning;
        let mut notices = Vec::new();
        let mut tell = |count: usize, notice: fn(usize) -> Notice| {
            if count > 0 {
                notices.push(notice(count));
            }
        };
        tell(self.boundary_edges, Notice::Open);
        if let Some(own) = self.self_intersections.filter(SelfIntersections::any) {
            tell(own.triangles, if own.complete { Notice::SelfIntersecting } else { Notice::SelfIntersectingAtLeast });
        }
        tell(self.non_manifold_edges, Notice::NonManifoldEdges);
        tell(self.disagreeing_edges, Notice::DisagreeingEdges);
        tell(cleaning.one_sided_components, Notice::OneSided);
        tell(self.pinched_vertices, Notice::PinchedVertices);
        tell(self.self_intersections.map_or(0, |own| own.touching_pairs), Notice::Touching);
        tell(cleaning.inverted_components, Notice::Inverted);
        tell(cleaning.turned_triangles, Notice::Turned);
        tell(cleaning.duplicate_triangles, Notice::Duplicates);
        tell(cleaning.empty_triangles, Notice::EmptyTriangles);
        tell(cleaning.exchanged_triangles, Notice::ExchangedTriangles);
        tell(cleaning.degenerate_faces, Notice::DegenerateFaces);
        tell(cleaning.self_crossing_faces, Notice::SelfCrossingFaces);
        tell(cleaning.welded_vertices, Notice::Welded);
        tell(cleaning.unused_vertices, Notice::Unused);
        notices
    }
}

/// One thing that a user should know about a mesh; each holds a count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    /// Boundary edges.
    Open(usize),
    /// Triangles that cross or overlap others.
    SelfIntersecting(usize),
    /// The same, not all having been looked at.
    SelfIntersectingAtLeast(usize),
    /// Edges of three or more triangles.
    NonManifoldEdges(usize),
    /// Edges of two triangles that disagree.
    DisagreeingEdges(usize),
    /// Components without an outside.
    OneSided(usize),
    /// Vertices where parts touch.
    PinchedVertices(usize),
    /// Pairs of triangles that touch.
    Touching(usize),
    /// Components that were inside out.
    Inverted(usize),
    /// Triangles turned to agree with the others.
    Turned(usize),
    /// Duplicated triangles dropped.
    Duplicates(usize),
    /// Triangles of no area dropped.
    EmptyTriangles(usize),
    /// Triangles of no area exchanged.
    ExchangedTriangles(usize),
    /// Degenerate faces dropped.
    DegenerateFaces(usize),
    /// Polygons that cross themselves.
    SelfCrossingFaces(usize),
    /// Vertices welded.
    Welded(usize),
    /// Vertices that nothing uses.
    Unused(usize),
}

impl Notice {
    /// Does it limit what can be felt, or was it only tidying up?
    pub fn is_warning(&self) -> bool {
        matches!(
            self,
            Self::Open(_)
                | Self::SelfIntersecting(_)
                | Self::SelfIntersectingAtLeast(_)
                | Self::NonManifoldEdges(_)
                | Self::DisagreeingEdges(_)
                | Self::OneSided(_)
                | Self::SelfCrossingFaces(_)
        )
    }
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, one, many, rest) = match *self {
            Self::Open(n) => (
                n,
                "edge",
                "edges",
                "at an open boundary: it is felt as a surface, only as deep as its pieces are thick",
            ),
            Self::SelfIntersecting(n) => (
                n,
                "triangle",
                "triangles",
                "crossing or overlapping others: depth there is only as deep as the pieces are thick",
            ),
            Self::SelfIntersectingAtLeast(n) => (
                n,
                "triangle",
                "triangles",
                "or more crossing or overlapping others (not all were looked at): depth there is only as deep as the pieces are thick",
            ),
            Self::NonManifoldEdges(n) => (n, "edge", "edges", "shared by three or more triangles: treated as a crease"),
            Self::DisagreeingEdges(n) => {
                (n, "edge", "edges", "between triangles that disagree about which side is outside")
            }
            Self::OneSided(n) => (n, "component", "components", "without an outside, like a Möbius band"),
            Self::PinchedVertices(n) => (n, "vertex", "vertices", "where separate parts of the surface touch"),
            Self::Touching(n) => (n, "pair", "pairs", "of triangles touching without sharing that corner or edge"),
            Self::Inverted(n) => (n, "closed component", "closed components", "inside out: turned"),
            Self::Turned(n) => (n, "triangle", "triangles", "facing the wrong way: turned to agree with the others"),
            Self::Duplicates(n) => (n, "triangle", "triangles", "with the same corners as an earlier one: dropped"),
            Self::EmptyTriangles(n) => (n, "triangle", "triangles", "without area: dropped"),
            Self::ExchangedTriangles(n) => {
                (n, "triangle", "triangles", "without area: removed by cutting a neighbour; nothing opened")
            }
            Self::DegenerateFaces(n) => (n, "face", "faces", "with fewer than three different corners: dropped"),
            Self::SelfCrossingFaces(n) => {
                (n, "polygon", "polygons", "crossing itself: cut into triangles as well as can be")
            }
            Self::Welded(n) => (n, "vertex", "vertices", "at the same place as an earlier one: welded"),
            Self::Unused(n) => (n, "vertex", "vertices", "that no face uses: dropped"),
        };
        write!(f, "{count} {} {rest}", if count == 1 { one } else { many })
    }
}

/// The fans of triangles around vertices: corners connected across the sides that meet there.
struct Fans {
    /// Number of fans of each vertex.
    at_vertex: Vec<u32>,
    /// Number of fans of each component.
    of_component: Vec<usize>,
}

impl Fans {
    fn new(mesh: &Mesh, edges: &HalfEdges) -> Self {
        let mut answer =
            Self { at_vertex: vec![0; mesh.vertices().len()], of_component: vec![0; mesh.component_count()] };
        let mut seen = vec![false; 3 * mesh.triangles().len()];
        for (t, k) in (0..mesh.triangles().len() as u32).flat_map(|t| [(t, 0), (t, 1), (t, 2)]) {
            if seen[3 * t as usize + k] {
                continue;
            }
            answer.at_vertex[mesh.triangles()[t as usize][k] as usize] += 1;
            answer.of_component[mesh.component(t) as usize] += 1;
            // Around in one direction, and in the other if a boundary cut that short.
            let mut corner = Some((t, k));
            while let Some((t, k)) = corner.filter(|&(t, k)| !seen[3 * t as usize + k]) {
                seen[3 * t as usize + k] = true;
                corner = edges.neighbour(t, k).map(|(other, j)| (other, (j + 1) % 3));
            }
            let mut corner = edges.neighbour(t, (k + 2) % 3);
            while let Some((t, k)) = corner.filter(|&(t, k)| !seen[3 * t as usize + k]) {
                seen[3 * t as usize + k] = true;
                corner = edges.neighbour(t, (k + 2) % 3);
            }
        }
        answer
    }
}

fn components(mesh: &Mesh, edges: &HalfEdges, fans: &Fans) -> Vec<ComponentHealth> {
    let count = mesh.component_count();
    let (mut triangles, mut whole) = (vec![0_usize; count], vec![true; count]);
    for t in 0..mesh.triangles().len() as u32 {
        let c = mesh.component(t) as usize;
        triangles[c] += 1;
        whole[c] &= (0..3).all(|k| edges.neighbour(t, k).is_some());
    }
    (0..count)
        .map(|c| {
            // V − E + F = 2 − 2 g with three sides to a triangle and two to an edge: 2 g = 2 − V + F / 2.
            let twice = 2 + triangles[c] as i64 / 2 - fans.of_component[c] as i64;
            let genus = (whole[c] && twice >= 0).then_some(twice as usize / 2);
            ComponentHealth { triangles: triangles[c], closed: mesh.is_component_closed(c as u32), genus }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::body::PolygonSoup;
    use crate::body::shapes::{Random, cuboid, model, torus};
    use crate::body::{MassProperties, ShadingNormals};

    fn examine(soup: &PolygonSoup) -> Health {
        let (mesh, cleaning) = Mesh::from_soup(soup).unwrap();
        Health::full(&mesh, &HalfEdges::new(&mesh), &mesh.tree(), cleaning)
    }

    fn soup_of(meshes: &[&Mesh]) -> PolygonSoup {
        let mut soup = PolygonSoup::new();
        for mesh in meshes {
            let base = soup.vertices.len() as u32;
            soup.vertices.extend(mesh.vertices());
            mesh.triangles().iter().for_each(|t| soup.push_face(&t.map(|v| v + base)));
        }
        soup
    }

    #[test]
    fn sound_shapes_are_sound() {
        let (ring, block) = (torus(1.0, 0.4, 12, 8), cuboid(DVec3::splat(5.0), DVec3::splat(6.0)));
        let health = examine(&soup_of(&[&ring, &block, &ring]));
        // The second ring coincides with the first.
        assert_eq!(health.cleaning.duplicate_triangles, ring.triangles().len());
        assert_eq!((health.genus(), health.components.len(), health.closed), (Some(1), 2, true));
        assert_eq!(health.components[1], ComponentHealth { triangles: 12, closed: true, genus: Some(0) });
        assert_eq!(health.self_intersections, Some(SelfIntersections { complete: true, ..Default::default() }));
        assert!(health.notices().iter().all(|notice| !notice.is_warning()));
    }

    #[test]
    fn crossing_touching_open_and_pinched_are_told() {
        let cube = |low: f64, high: f64| cuboid(DVec3::splat(low), DVec3::splat(high));
        let crossing = examine(&soup_of(&[&cube(0.0, 1.0), &cube(0.45, 1.55)]));
        assert!(crossing.self_intersections.unwrap().crossing_pairs > 0 && crossing.closed);
        assert!(matches!(crossing.notices()[0], Notice::SelfIntersecting(_)));

        let corner = examine(&soup_of(&[&cube(0.0, 1.0), &cube(1.0, 2.0)]));
        assert_eq!((corner.pinched_vertices, corner.genus()), (1, None));
        assert!(corner.components.iter().all(|c| c.closed && c.genus == Some(0)));
        assert!(!corner.self_intersections.unwrap().any());

        // Side by side with a common edge: four triangles there.
        let edge = examine(&soup_of(&[&cube(0.0, 1.0), &cuboid(DVec3::new(1.0, 1.0, 0.0), DVec3::new(2.0, 2.0, 1.0))]));
        assert_eq!((edge.non_manifold_edges, edge.pinched_vertices, edge.boundary_edges), (1, 0, 0));
        assert!(edge.closed && !edge.is_manifold() && edge.components.len() == 2);

        let shelf =
            examine(&soup_of(&[&cube(0.0, 1.0), &cuboid(DVec3::new(0.2, 0.2, 1.0), DVec3::new(0.8, 0.8, 2.0))]));
        assert!(shelf.self_intersections.unwrap().overlapping_pairs > 0);

        let closed = cube(0.0, 1.0);
        let open = examine(&PolygonSoup::from_triangles(closed.vertices().to_vec(), &closed.triangles()[1..]));
        assert_eq!((open.boundary_edges, open.closed, open.genus()), (3, false, None));
        assert_eq!(open.notices(), [Notice::Open(3)]);
        assert!(open.notices()[0].to_string().starts_with("3 edges at an open boundary"));
    }

    #[test]
    fn whatever_comes_in_everything_is_answered() {
        const SEED: u64 = 0xbad_50b;
        let mut random = Random(SEED);
        let mut meshes = 0;
        for case in 0..3000 {
            let mut soup = PolygonSoup::new();
            let grid = 2 + random.below(3);
            let count = 3 + random.below(10);
            for _ in 0..count {
                // Few places, so that corners coincide, polygons fold and triangles have no area.
                let jitter = random.vector() * if random.below(3) == 0 { 1e-10 } else { 0.0 };
                let place = [0; 3].map(|_| random.below(grid) as f64);
                soup.vertices.push(DVec3::from(place) + jitter);
            }
            for _ in 0..random.below(20) {
                let corners: Vec<u32> = (0..random.below(7)).map(|_| random.below(count) as u32).collect();
                soup.push_face(&corners);
            }
            let Ok((mesh, cleaning)) = Mesh::from_soup(&soup) else { continue };
            meshes += 1;
            let (edges, tree) = (HalfEdges::new(&mesh), mesh.tree());
            let health = Health::full(&mesh, &edges, &tree, cleaning);
            assert!(health.self_intersections.unwrap().complete);
            assert!(health.notices().iter().all(|notice| !notice.to_string().is_empty()));
            let mass = MassProperties::new(&mesh);
            assert!(mass.volume > 0.0 && mass.inertia.is_finite() && mass.center_of_mass.is_finite());
            let shading = ShadingNormals::new(&mesh, &edges, 0.7);
            for t in 0..mesh.triangles().len() as u32 {
                assert!((mesh.triangle_normal(t).length() - 1.0).abs() < 1e-12, "seed {SEED}, case {case}");
                let at = shading.at_point(&mesh, t, random.vector());
                assert!((at.length() - 1.0).abs() < 1e-12, "seed {SEED}, case {case}");
                for k in 0..3 {
                    if let Some((other, j)) = edges.neighbour(t, k) {
                        assert_eq!(edges.neighbour(other, j), Some((t, k)), "seed {SEED}, case {case}");
                    }
                }
            }
            if mesh.is_closed() {
                let p = (random.vector() + 1.0) * grid as f64 / 2.0;
                let winding = tree.winding_number(p);
                assert_eq!(tree.inside(p), winding > 0.5, "seed {SEED}, case {case}: {winding}");
            }
        }
        assert!(meshes > 1000, "{meshes}");
    }

    /// What is known of real models: file, triangles left, closed, genus, self-intersecting, components.
    type Known = (&'static str, usize, bool, Option<usize>, bool, usize);

    /// Counts that come from other programs: closed, genus and the number of the file's triangles for all; self-intersections
    /// where that program looked for exact crossings. Coplanar folds of the hole's stitched rim it did not look for.
    const KNOWN: [Known; 17] = [
        ("paper/teacup_500.obj", 500, true, Some(1), false, 1),
        ("paper/teacup_4972.obj", 4972, true, Some(1), true, 1),
        ("paper/teaspoon_336.obj", 336, true, Some(0), false, 1),
        ("paper/teacup_newell_original.obj", 3328, false, None, true, 2),
        ("parts/fandisk.obj", 12946, true, Some(0), false, 1),
        ("parts/plate_holes.obj", 1252, true, Some(5), false, 1),
        ("parts/ur5_wrist1_collision.obj", 702, true, Some(0), false, 2),
        ("pairs/gear_base.obj", 4992, true, Some(4), false, 1),
        ("pairs/gear_small.obj", 20524, true, Some(2), true, 1),
        ("pairs/hole_round_8mm_factory.obj", 928, true, Some(1), true, 1),
        ("nasty/casting_inverted.obj", 10224, true, Some(9), false, 1),
        ("nasty/footbones_26_parts.obj", 4204, true, Some(0), true, 26),
        ("nasty/hourglass_pinched_vertex.obj", 40, true, None, false, 2),
        ("nasty/many_small_holes.obj", 3524, false, None, false, 1),
        ("nasty/non_manif_hole.obj", 755, false, None, false, 1),
        ("nasty/self_intersectA.obj", 17160, true, Some(0), true, 1),
        ("nasty/truck_shrec.obj", 4770, false, None, true, 66),
    ];

    #[test]
    fn real_models_are_what_they_are_known_to_be() {
        for (name, triangles, closed, genus, self_intersecting, components) in KNOWN {
            let Some(soup) = model(name) else { continue };
            let health = examine(&soup);
            let own = health.self_intersections.unwrap();
            let count: usize = health.components.iter().map(|c| c.triangles).sum();
            let found = (name, count, health.closed, health.genus(), own.any(), health.components.len());
            assert_eq!(found, (name, triangles, closed, genus, self_intersecting, components));
        }
    }

    #[test]
    fn counts_of_nasty_models_are_those_that_others_found() {
        let counts = |name: &str| model(name).map(|soup| examine(&soup));
        if let Some(health) = counts("nasty/colon_double_sheets.obj") {
            assert_eq!(health.cleaning.duplicate_triangles, 3240);
        }
        if let Some(health) = counts("nasty/self_intersectA.obj") {
            assert_eq!(health.self_intersections.unwrap().triangles, 334);
        }
        if let Some(health) = counts("nasty/many_small_holes.obj") {
            assert_eq!(health.boundary_edges, 556);
        }
        if let Some(health) = counts("nasty/casting_inverted.obj") {
            assert_eq!(health.notices(), [Notice::Inverted(1)]);
        }
        if let Some(health) = counts("pairs/gear_small.obj") {
            // Two triangles of no area; the surface stays closed without them.
            assert_eq!((health.cleaning.exchanged_triangles, health.closed), (2, true));
        }
        if let Some(health) = counts("pairs/hole_round_8mm_factory.obj") {
            // Counted with rational arithmetic by another program.
            assert_eq!(health.self_intersections.unwrap().overlapping_pairs, 559);
        }
    }
}
