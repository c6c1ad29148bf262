//! Components of a mesh, turned so that their triangles agree and their normals point outward.
//!
//! 1. Triangles are connected across edges that exactly two of them use. Walking across those
//!    edges, each triangle is turned to agree with the one before; if most of a component would
//!    turn, the others turn instead.
//! 2. A component is closed when each of its edges is used as often in either direction. The sign
//!    of its volume then tells its orientation. Open components keep the file's orientation.
//! 3. Closed components nest. An outermost one of negative volume is inside out, and with it
//!    everything in it: all of it is turned. A component inside another and of opposite sign is a
//!    cavity and stays as it is. Only if the file's orientation is inconsistent within a component
//!    does the nesting depth decide: even is solid, odd is a cavity.
//!
//! A component lies inside another if its box and its sample vertices do. If components cross,
//! neither is inside the other.

use glam::DVec3;

use crate::algebra::tolerance;
use crate::body::mesh::edge_uses::EdgeUses;
use crate::body::{Aabb, TriangleTree};

/// Findings and changes of orienting.
#[derive(Clone, Debug, Default)]
pub(in crate::body) struct Orientation {
    /// For each triangle its component.
    pub(in crate::body) component: Vec<u32>,
    /// For each component: no boundary, and its triangles agree.
    pub(in crate::body) closed: Vec<bool>,
    /// All edges of the mesh are used as often in either direction.
    pub(in crate::body) balanced: bool,
    /// Triangles turned to agree with their neighbours.
    pub(in crate::body) turned: usize,
    /// Components that were inside out.
    pub(in crate::body) inverted: usize,
    /// Components that cannot be turned to agree.
    pub(in crate::body) one_sided: usize,
}

/// Turns `triangles` as the module's description says.
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
    let balance = Balance::new(&EdgeUses::new(vertices.len(), triangles), triangles, &answer.component, members.len());
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
        // Turning a whole component can also repair or break the orientation at edges that it
        // shares with others.
        let uses = EdgeUses::new(vertices.len(), triangles);
        answer.balanced = Balance::new(&uses, triangles, &answer.component, members.len()).whole;
    }
    answer
}

/// Components, and which triangles must turn for each to agree with its first triangle.
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
                    // Neighbours that agree run along their edge in opposite directions.
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

/// Is each edge used as often in either direction, by each component and by all together?
struct Balance {
    closed: Vec<bool>,
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

/// Six times the signed volume of a closed set of triangles, about its first corner.
fn volume(vertices: &[DVec3], triangles: &[[u32; 3]], members: &[u32]) -> f64 {
    let point = |v: u32| vertices[v as usize];
    let origin = members.first().map_or(DVec3::ZERO, |&t| point(triangles[t as usize][0]));
    let six = |&t: &u32| {
        let [a, b, c] = triangles[t as usize].map(|v| point(v) - origin);
        a.dot(b.cross(c))
    };
    members.iter().map(six).sum()
}

/// The closed components that have to be turned whole.
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
        // The outermost enclosing component lies in no other. Its sign decides for everything
        // inside it.
        holders.iter().any(|&h| around[h].is_empty() && volumes[h] < 0.0)
    };
    candidates.iter().copied().filter(|&c| inverted(c)).collect()
}

/// For each component, the closed components that it lies inside of.
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
            // Samples on the outer surface itself do not decide.
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
