//! Finds the components of a mesh. Orients each component so that its triangles agree and its
//! normals point outward.
//!
//! 1. Triangles are connected across edges that exactly two triangles use. Starting from one
//!    triangle, each connected triangle is flipped if it disagrees with its neighbour. If most
//!    triangles of a component disagree with the first triangle, the triangles that agree are
//!    flipped instead.
//! 2. A component is closed if each of its edges is used equally often in both directions. The
//!    sign of its volume then gives its orientation. Open components keep the orientation of the
//!    file.
//! 3. Closed components can be nested. If an outermost component has a negative volume, this
//!    component and all components inside it are inside out, and all their triangles are flipped. A
//!    component inside another component of opposite sign is a cavity and does not change. If the
//!    file's orientation is inconsistent within a component, the nesting depth decides instead: an
//!    even depth is solid, an odd depth is a cavity.
//!
//! A component lies inside another if its bounding box and a sample of its vertices lie inside the
//! other. If two components cross, neither counts as inside the other.

use glam::DVec3;

use crate::algebra::tolerance;
use crate::body::mesh::edge_uses::EdgeUses;
use crate::body::mesh::sheet::sheets;
use crate::body::{Aabb, TriangleTree};

/// The components and the changes that [`orient`] made.
#[derive(Clone, Debug, Default)]
pub(in crate::body) struct Orientation {
    /// The component of each triangle.
    pub(in crate::body) component: Vec<u32>,
    /// For each component, true if it has no boundary and its triangles agree.
    pub(in crate::body) closed: Vec<bool>,
    /// For each component, true if it is a sheet ([`super::Mesh::is_sheet`]).
    pub(in crate::body) sheet: Vec<bool>,
    /// True if each edge of the mesh is used equally often in both directions.
    pub(in crate::body) balanced: bool,
    /// Number of triangles that were flipped to agree with their neighbours.
    pub(in crate::body) turned: usize,
    /// Number of components that were inside out.
    pub(in crate::body) inverted: usize,
    /// Number of components whose triangles cannot be oriented consistently.
    pub(in crate::body) one_sided: usize,
}

/// Orients `triangles` by the steps of the module's description.
pub(in crate::body) fn orient(vertices: &[DVec3], triangles: &mut [[u32; 3]]) -> Orientation {
    let uses = EdgeUses::new(vertices.len(), triangles);
    let Agreement { component, members, turn, one_sided } = Agreement::new(&uses, triangles);
    let mut answer = Orientation { component, ..Orientation::default() };
    let mut trusted = vec![true; members.len()];
    for (c, members) in members.iter().enumerate() {
        let turned = members.iter().filter(|&&t| turn[t as usize]).count();
        let flip_others = 2 * turned > members.len();
        for &t in members.iter().filter(|&&t| turn[t as usize] != flip_others) {
            triangles[t as usize].swap(1, 2);
        }
        trusted[c] = turned == 0 || turned == members.len();
        answer.turned += turned.min(members.len() - turned);
        answer.one_sided += usize::from(one_sided[c]);
    }
    let uses = EdgeUses::new(vertices.len(), triangles);
    let balance = Balance::new(&uses, triangles, &answer.component, members.len());
    answer.sheet = sheets(&uses, vertices, triangles, &answer.component, members.len());
    answer.closed = balance.closed;
    answer.balanced = balance.whole;
    let inverted = inside_out(vertices, triangles, &members, &answer.closed, &trusted);
    for c in inverted {
        answer.inverted += 1;
        for &t in &members[c] {
            triangles[t as usize].swap(1, 2);
        }
    }
    if answer.inverted > 0 && !answer.balanced {
        // Flipping a component can also repair or break the orientation at edges that it shares
        // with other components.
        let uses = EdgeUses::new(vertices.len(), triangles);
        answer.balanced = Balance::new(&uses, triangles, &answer.component, members.len()).whole;
    }
    answer
}

/// The components, and which triangles must be flipped to agree with the first triangle of their
/// component.
struct Agreement {
    component: Vec<u32>,
    members: Vec<Vec<u32>>,
    turn: Vec<bool>,
    one_sided: Vec<bool>,
}

impl Agreement {
    fn new(uses: &EdgeUses, triangles: &[[u32; 3]]) -> Self {
        let mut across = vec![u32::MAX; 3 * triangles.len()];
        for pair in uses.edges().filter(|uses| uses.len() == 2) {
            (across[pair[0] as usize], across[pair[1] as usize]) = (pair[1], pair[0]);
        }
        let start = |side: u32| triangles[(side / 3) as usize][(side % 3) as usize];
        let mut answer = Self {
            component: vec![u32::MAX; triangles.len()],
            members: Vec::new(),
            turn: vec![false; triangles.len()],
            one_sided: Vec::new(),
        };
        for seed in 0..triangles.len() {
            if answer.component[seed] != u32::MAX {
                continue;
            }
            let c = answer.members.len() as u32;
            answer.component[seed] = c;
            let (mut members, mut one_sided, mut next) = (vec![seed as u32], false, 0);
            while let Some(&t) = members.get(next) {
                next += 1;
                for side in 3 * t..3 * t + 3 {
                    let twin = across[side as usize];
                    if twin == u32::MAX {
                        continue;
                    }
                    let other = (twin / 3) as usize;
                    // Two triangles agree if their sides run along the common edge in opposite
                    // directions.
                    let turn = answer.turn[t as usize] != (start(side) == start(twin));
                    if answer.component[other] == u32::MAX {
                        answer.component[other] = c;
                        answer.turn[other] = turn;
                        members.push(other as u32);
                    } else {
                        one_sided |= answer.turn[other] != turn;
                    }
                }
            }
            answer.members.push(members);
            answer.one_sided.push(one_sided);
        }
        answer
    }
}

/// Result of counting the directions in which each edge is used.
struct Balance {
    /// For each component, true if it uses each edge equally often in both directions.
    closed: Vec<bool>,
    /// True if the whole mesh uses each edge equally often in both directions.
    whole: bool,
}

impl Balance {
    fn new(uses: &EdgeUses, triangles: &[[u32; 3]], component: &[u32], count: usize) -> Self {
        let mut answer = Self { closed: vec![true; count], whole: true };
        for edge in uses.edges() {
            let direction = |side: u32| {
                let triangle = triangles[(side / 3) as usize];
                if triangle[(side % 3) as usize] < triangle[(side as usize % 3 + 1) % 3] { 1 } else { -1 }
            };
            answer.whole &= edge.iter().map(|&side| direction(side)).sum::<i32>() == 0;
            for &side in edge {
                let c = component[(side / 3) as usize];
                let own = edge.iter().filter(|&&other| component[(other / 3) as usize] == c);
                if own.map(|&other| direction(other)).sum::<i32>() != 0 {
                    answer.closed[c as usize] = false;
                }
            }
        }
        answer
    }
}

/// Returns six times the signed volume of a closed set of triangles, computed relative to the first
/// corner.
fn volume(vertices: &[DVec3], triangles: &[[u32; 3]], members: &[u32]) -> f64 {
    let point = |v: u32| vertices[v as usize];
    let origin = members.first().map_or(DVec3::ZERO, |&t| point(triangles[t as usize][0]));
    let six = |&t: &u32| {
        let [a, b, c] = triangles[t as usize].map(|v| point(v) - origin);
        a.dot(b.cross(c))
    };
    members.iter().map(six).sum()
}

/// Returns the closed components that are inside out.
fn inside_out(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    members: &[Vec<u32>],
    closed: &[bool],
    trusted: &[bool],
) -> Vec<usize> {
    let candidates: Vec<usize> = (0..members.len()).filter(|&c| closed[c]).collect();
    let volumes: Vec<f64> = members.iter().map(|m| volume(vertices, triangles, m)).collect();
    let around = containers(vertices, triangles, members, &candidates);
    let inverted = |c: usize| {
        let holders = &around[c];
        if holders.is_empty() {
            return volumes[c] < 0.0;
        }
        if !trusted[c] {
            return (volumes[c] < 0.0) == holders.len().is_multiple_of(2);
        }
        // The outermost enclosing component lies in no other component. The sign of its volume
        // decides whether all components inside it are inside out.
        holders.iter().any(|&h| around[h].is_empty() && volumes[h] < 0.0)
    };
    candidates.iter().copied().filter(|&c| inverted(c)).collect()
}

/// Returns for each component the closed components that enclose it.
fn containers(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    members: &[Vec<u32>],
    candidates: &[usize],
) -> Vec<Vec<usize>> {
    let boxes: Vec<Aabb> = members
        .iter()
        .map(|m| Aabb::around(m.iter().flat_map(|&t| triangles[t as usize]).map(|v| vertices[v as usize])))
        .collect();
    let nested = |inner: &Aabb, outer: &Aabb| outer.min.cmplt(inner.min).all() && inner.max.cmplt(outer.max).all();
    let mut answer = vec![Vec::new(); members.len()];
    for &outer in candidates {
        let mut tree = None;
        for &inner in candidates {
            if inner == outer || !nested(&boxes[inner], &boxes[outer]) {
                continue;
            }
            let tree =
                tree.get_or_insert_with(|| TriangleTree::over(vertices, triangles, members[outer].clone(), true));
            let step = members[inner].len().div_ceil(tolerance::NESTING_SAMPLES);
            // Sample vertices on the outer component's surface are skipped.
            let mut windings = members[inner]
                .iter()
                .step_by(step)
                .filter_map(|&t| tree.crossings(vertices[triangles[t as usize][0] as usize]))
                .peekable();
            let within = windings.peek().is_some() && windings.all(|winding| winding != 0);
            if within {
                answer[inner].push(outer);
            }
        }
    }
    answer
}
