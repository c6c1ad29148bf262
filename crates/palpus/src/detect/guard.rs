//! The guard against tunnelling: keeps contacts if the motion in a tick is larger than the
//! thickness of a part.
//!
//! 1. If a point moves farther in a tick than a fraction of the tolerance, the tick is divided into
//!    *sub-steps* of about this fraction. Each sub-step finds the contacts of thin pieces, which
//!    are thinner than a few times the tick's motion. So each contact of a thin piece is found
//!    within the tolerance on the side of entry, and its depth walk starts there. A body that
//!    enters a thicker piece in one tick is still near the side of entry, except at the tip of an
//!    edge, which it may pass.
//! 2. In fast ticks, the two points of each contact are *traced* from one pose to the next. A
//!    point of a has tunnelled if it leaves b's piece through a face that looks away from the
//!    side of entry. The same rule applies to a point of b in a's piece. A pair has also tunnelled
//!    if it overlaps before or after a sub-step and its normal reverses in the sub-step.
//! 3. A pair that has tunnelled is put on the list of *sides*. While it is on the list, its contact
//!    has the normal of the side from which it came, whatever the march returns. The contact's
//!    separation is the gap between the two support planes along this normal.
//! 4. A side is dropped in these cases: the pair is apart along the side's normal; its point has
//!    slid off the edge of the piece; the query finds a contact on this side again. A side is also
//!    dropped if the pair becomes a fixed number of tolerances deeper than at the moment of
//!    tunnelling. So a tool that is pushed hard enough passes through the part.
//!
//! Direct rendering has no proxy that stays on the surface. For thin parts, the useful property of
//! a proxy is its memory of the side. The guard adds this memory only for pairs that tunnelled.

use glam::{DQuat, DVec3, DVec4};

use super::Contact;
use super::memory::PairMemory;
use super::query_input::QueryInput;
use crate::algebra::tolerance::{COPLANAR, GUARD_HOLD, GUARD_STEP, GUARD_SUB_STEPS, TURNED_OVER};
use crate::algebra::{Placement, Pose};
use crate::body::Polytope;
use crate::collision::support_gap;

/// Returns the number of sub-steps of a tick: 1 if the motion is slow, or if it is a jump that is
/// too fast to divide.
pub(super) fn sub_steps(travel: f64, tolerance: f64) -> u32 {
    let parts = (travel / (GUARD_STEP * tolerance)).ceil();
    if parts <= f64::from(GUARD_SUB_STEPS) { (parts as u32).max(1) } else { 1 }
}

/// Returns the pose at `fraction` of the motion.
pub(super) fn between(from: &Pose, to: &Pose, fraction: f64) -> Pose {
    let near = if from.rotation.dot(to.rotation) < 0.0 { -to.rotation } else { to.rotation };
    let turned = DVec4::from(from.rotation).lerp(DVec4::from(near), fraction);
    Pose::new(DQuat::from_vec4(turned), from.translation.lerp(to.translation, fraction))
}

/// Pairs that have tunnelled, each with its side of entry.
#[derive(Clone, Debug)]
pub(super) struct Guard {
    sides: Vec<KeptSide>,
    /// The contacts at the previous pose, in fast ticks.
    before: Vec<Contact>,
    /// Largest number of contacts of a query.
    capacity: usize,
    pose: Placement,
}

/// A pair that has tunnelled, and its side of entry.
#[derive(Clone, Copy, Debug)]
struct KeptSide {
    /// The contact before it tunnelled, with the traced points.
    contact: PairMemory,
    /// The contact's normal, in b's frame.
    normal: DVec3,
    /// True if the point of a went through b; false if the point of b went through a.
    by_a: bool,
    /// Vertices of a and b near the support vertices along the normal.
    hub: [u32; 2],
    /// Depth at which the side is dropped; `None` until the depth is measured for the first time.
    deepest: Option<f64>,
}

impl Guard {
    /// Largest number of listed pairs; if the list is full, further pairs tunnel.
    const SIDES: usize = 64;

    /// Returns an empty list, with memory for `capacity` contacts.
    pub(super) fn new(capacity: usize) -> Self {
        let (sides, before) = (Vec::with_capacity(Self::SIDES), Vec::with_capacity(capacity));
        Self { sides, before, capacity, pose: Placement::IDENTITY }
    }

    /// Drops all sides.
    pub(super) fn clear(&mut self) {
        self.sides.clear();
        self.before.clear();
    }

    /// Lists the pairs among `contacts` whose points tunnel between the pose `from` and the queried
    /// pose.
    pub(super) fn trace<'c>(
        &mut self,
        input: &QueryInput<'_>,
        contacts: impl Iterator<Item = &'c Contact>,
        from: &Placement,
    ) {
        let to = &input.place;
        self.before.clear();
        self.pose = *from;
        for contact in contacts.take(self.capacity) {
            self.before.push(*contact);
            let (piece_a, piece_b) = input.pieces(contact.piece_a, contact.piece_b);
            let (point_a, point_b) = (from.inverse_point(contact.point_a), contact.point_b);
            let by_a = leaves_behind(piece_b, contact.point_a, to.point(point_a), contact.normal);
            let down = -to.inverse_vector(contact.normal);
            if by_a || leaves_behind(piece_a, from.inverse_point(point_b), to.inverse_point(point_b), down) {
                self.list(contact, by_a);
            }
        }
    }

    /// Lists the pairs whose normal is reversed in the `contacts` of the next pose.
    pub(super) fn compare(&mut self, contacts: &[Contact]) {
        let mut next = 0;
        for k in 0..self.before.len() {
            let before = self.before[k];
            // Both lists have nearly the same order.
            let count = contacts.len();
            let same = |i: &usize| {
                let contact = &contacts[i % count];
                [contact.piece_a, contact.piece_b] == [before.piece_a, before.piece_b]
            };
            let Some(i) = (next..next + count).find(same) else { continue };
            next = i % count;
            let contact = &contacts[next];
            let overlaps = before.separation <= 0.0 || contact.separation <= 0.0;
            if overlaps && contact.normal.dot(before.normal) < TURNED_OVER {
                self.list(&before, false);
            }
        }
        self.before.clear();
    }

    fn list(&mut self, contact: &Contact, by_a: bool) {
        let pieces = [contact.piece_a, contact.piece_b];
        if self.sides.len() == Self::SIDES || self.sides.iter().any(|side| side.contact.pieces == pieces) {
            return;
        }
        self.sides.push(KeptSide {
            // One traced point represents the whole side.
            contact: PairMemory::of(&Contact { slope: 0.0, ..*contact }, &self.pose),
            normal: contact.normal,
            by_a,
            hub: [0; 2],
            deepest: None,
        });
    }

    /// Replaces the contacts of listed pairs in `contacts` by contacts on their sides. Returns the
    /// number of added contacts.
    pub(super) fn hold(&mut self, input: &QueryInput<'_>, contacts: &mut Vec<Contact>) -> u32 {
        let mut held = 0;
        self.sides.retain_mut(|side| {
            let found = contacts.iter().position(|c| [c.piece_a, c.piece_b] == side.contact.pieces);
            if found.is_some_and(|k| contacts[k].normal.dot(side.normal) > 0.0) {
                return false;
            }
            let Some(contact) = side.contact(input) else { return false };
            match found {
                Some(k) => contacts[k] = contact,
                None if contacts.len() < self.capacity => contacts.push(contact),
                None => return false,
            }
            held += 1;
            true
        });
        held
    }
}

impl KeptSide {
    /// Returns the contact on this side at the present pose; `None` if the side is dropped.
    fn contact(&mut self, input: &QueryInput<'_>) -> Option<Contact> {
        let QueryInput { place, tolerance, .. } = input;
        let (piece_a, piece_b) = input.pieces(self.contact.pieces[0], self.contact.pieces[1]);
        let normal = self.normal;
        let down = -place.inverse_vector(normal);
        let separation;
        (separation, self.hub) = support_gap(piece_a, piece_b, place, normal, self.hub);
        let deepest = *self.deepest.get_or_insert(GUARD_HOLD * tolerance - separation);
        let point_a = place.point(self.contact.point_a);
        // The line back along the normal crosses the piece.
        let below = if self.by_a {
            through(piece_b, point_a, point_a + normal * deepest).is_some()
        } else {
            let point_b = place.inverse_point(self.contact.point_b);
            through(piece_a, point_b, point_b + down * deepest).is_some()
        };
        if separation >= 0.0 || -separation > deepest || !below {
            return None;
        }
        let midpoint = if self.by_a {
            point_a - normal * (0.5 * separation)
        } else {
            self.contact.point_b + normal * (0.5 * separation)
        };
        Some(self.contact.contact(midpoint, normal, separation))
    }
}

/// Returns true if the path of a point leaves the polytope through a face that looks away from
/// `outward`, the side from which the point came.
fn leaves_behind(polytope: &Polytope, from: DVec3, to: DVec3, outward: DVec3) -> bool {
    through(polytope, from, to).is_some_and(|face| polytope.plane(face).normal.dot(outward) < 0.0)
}

/// Returns the face through which the segment leaves the polytope. `None` if the segment misses the
/// polytope or ends inside it.
fn through(polytope: &Polytope, from: DVec3, to: DVec3) -> Option<u32> {
    let (mut enters, mut leaves) = (0.0f64, (1.0f64, None));
    for face in 0..polytope.face_count() as u32 {
        let plane = polytope.plane(face);
        let (begin, end) = (plane.height(from), plane.height(to));
        if begin > 0.0 && end > 0.0 {
            return None;
        }
        if begin <= 0.0 && end > 0.0 {
            let at = begin / (begin - end);
            // Front and back of a plate without thickness lie in one plane; the segment leaves
            // through the back.
            if at <= leaves.0 {
                leaves = (at, Some(face));
            }
        } else if begin > 0.0 {
            enters = enters.max(begin / (begin - end));
        }
    }
    // In a plate, the segment enters and leaves at the same point.
    if enters <= leaves.0 + COPLANAR { leaves.1 } else { None }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::algebra::{NoClock, Random};
    use crate::body::{Body, BodySettings, Mesh, PolygonSoup};
    use crate::detect::{ContactQuery, QuerySettings};

    const TOLERANCE: f64 = 1e-3;

    fn cuboid(half: DVec3) -> Arc<Body> {
        let mut soup = PolygonSoup::new();
        let sign = |bit: bool| if bit { 1.0 } else { -1.0 };
        soup.vertices.extend((0..8).map(|k| half * DVec3::new(sign(k & 1 != 0), sign(k & 2 != 0), sign(k & 4 != 0))));
        for face in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
            soup.push_face(&face);
        }
        build(&soup)
    }

    /// Returns a square without thickness, in the plane z = 0.
    fn sheet(half: f64) -> Arc<Body> {
        let mut soup = PolygonSoup::new();
        soup.vertices
            .extend([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0) * half));
        soup.push_face(&[0, 1, 2, 3]);
        build(&soup)
    }

    fn build(soup: &PolygonSoup) -> Arc<Body> {
        let (mesh, _) = Mesh::from_soup(soup).unwrap();
        Arc::new(Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap())
    }

    fn query(a: Arc<Body>, b: Arc<Body>, guard: bool) -> ContactQuery {
        let settings = QuerySettings { tolerance: TOLERANCE, capacity: 64, guard, ..QuerySettings::default() };
        ContactQuery::new(a, b, settings)
    }

    /// Returns the deepest contact of each tick for a small cube that moves along `way`.
    fn go(wall: &Arc<Body>, way: &[DVec3], guarded: bool) -> Vec<Option<Contact>> {
        let probe = cuboid(DVec3::splat(1e-3));
        let mut query = query(probe, wall.clone(), guarded);
        way.iter()
            .map(|&p| {
                query
                    .contacts(&Pose::from_translation(p))
                    .iter()
                    .min_by(|c, d| c.separation.total_cmp(&d.separation))
                    .copied()
            })
            .collect()
    }

    /// Returns the positions on a line at 3 m/s and 1 kHz.
    fn straight(from: DVec3, to: DVec3) -> Vec<DVec3> {
        let ticks = (from.distance(to) / 3e-3).ceil() as u32;
        (0..=ticks).map(|k| from.lerp(to, f64::from(k) / f64::from(ticks))).collect()
    }

    #[test]
    fn fast_probe_touches_a_thin_wall() {
        for wall in [cuboid(DVec3::new(0.05, 0.05, 1e-4)), sheet(0.05)] {
            let mut way = straight(DVec3::new(0.011, 0.007, 0.0095), DVec3::new(0.011, 0.007, -0.007));
            let back = straight(*way.last().unwrap(), way[0]);
            way.extend(back);
            let bare = go(&wall, &way, false);
            let is_pushed_back = |contact: &Option<Contact>| contact.is_some_and(|contact| contact.normal.z > 0.0);
            assert!(way.iter().zip(&bare).any(|(p, contact)| p.z < 0.0 && !is_pushed_back(contact)));
            let guarded = go(&wall, &way, true);
            let mut below = 0;
            for (p, contact) in way.iter().zip(&guarded) {
                if p.z < 0.0 {
                    let contact = contact.unwrap_or_else(|| panic!("nothing felt at {p}"));
                    assert!((contact.normal - DVec3::Z).length() < 1e-9, "{contact:?}");
                    // The cube's lowest face is 1 mm below its middle, and the wall's top is at
                    // most 0.1 mm above z = 0.
                    assert!((contact.separation - (p.z - 1e-3)).abs() < 1.1e-4, "{contact:?} at {p}");
                    let gap = contact.point_a - contact.point_b - contact.normal * contact.separation;
                    assert!(gap.length() < 1e-12);
                    below += 1;
                }
            }
            assert!(below > 3);
            assert!(guarded.last().unwrap().is_none(), "out again");
        }
    }

    #[test]
    fn thick_parts_need_no_sub_steps() {
        // At 3 mm per tick, a sub-step finds the contact with the thin wall. For the thick wall and
        // for a thick probe, the query at the tick's end finds it.
        let probe = cuboid(DVec3::splat(0.02));
        for (half, cut) in [(1e-4, true), (0.02, false)] {
            let wall = cuboid(DVec3::new(0.05, 0.05, half));
            let mut query = query(probe.clone(), wall, true);
            let steps = |k: i32| 0.03 + half - 3e-3 * f64::from(k);
            let counted = (0..8).map(|k| {
                let pose = Pose::from_translation(DVec3::new(0.0, 0.0, steps(k)));
                query.run(&pose, &NoClock).sub_steps
            });
            let counted: Vec<u32> = counted.collect();
            assert!(counted[1..].iter().all(|&count| (count > 1) == cut), "{counted:?}");
            let least = query.found().iter().map(|contact| contact.normal.z).fold(1.0, f64::min);
            assert!(least > 0.99, "the contact must push to the side of entry: {least}");
        }
    }

    #[test]
    fn side_is_dropped_beyond_the_edge_or_when_deep() {
        let wall = cuboid(DVec3::new(0.05, 0.05, 1e-4));
        // The cube moves through the wall, and then sideways past its edge.
        let mut way = straight(DVec3::new(0.04, 0.0, 0.0095), DVec3::new(0.04, 0.0, -0.005));
        way.extend(straight(DVec3::new(0.04, 0.0, -0.005), DVec3::new(0.07, 0.0, -0.005)));
        let felt = go(&wall, &way, true);
        assert!(felt.iter().flatten().any(|contact| contact.separation < -0.004));
        assert!(felt.last().unwrap().is_none());
        // The cube moves through the wall, and far beyond it.
        let felt = go(&wall, &straight(DVec3::new(0.01, 0.0, 0.0095), DVec3::new(0.01, 0.0, -0.06)), true);
        assert!(felt.iter().flatten().any(|contact| contact.separation < -0.015));
        assert!(felt.last().unwrap().is_none());
    }

    #[test]
    fn probe_around_the_edge_has_not_tunnelled() {
        let wall = cuboid(DVec3::new(0.05, 0.05, 1e-4));
        // Half a turn about the edge x = 0.05 at a distance of 0.4 mm, then back under the wall.
        let round = (0..40).map(|k| {
            let angle = std::f64::consts::PI * f64::from(k) / 39.0;
            DVec3::new(0.05 + 1.6e-3 * angle.sin(), 0.0, 1.5e-3 * angle.cos())
        });
        let back = straight(DVec3::new(0.05, 0.0, -1.5e-3), DVec3::new(0.01, 0.0, -1.5e-3));
        for contact in go(&wall, &round.chain(back).collect::<Vec<_>>(), true).into_iter().flatten() {
            assert!(contact.separation > 0.0, "{contact:?}");
        }
    }

    #[test]
    fn slow_ticks_and_jumps_have_no_sub_steps() {
        for (travel, parts) in
            [(0.0, 1), (4.9e-4, 1), (5.1e-4, 2), (7.9e-3, 16), (8.1e-3, 1), (f64::INFINITY, 1), (f64::NAN, 1)]
        {
            assert_eq!(sub_steps(travel, TOLERANCE), parts, "{travel}");
        }
    }

    /// Returns a table with raised rims at x = ±50 mm; its top is at z = 0.
    fn table() -> Arc<Body> {
        let (half, thick, high) = (0.05, 1e-3, 4e-3);
        let (inner, mut soup) = (half - thick, PolygonSoup::new());
        let profile = [
            (-half, -thick),
            (half, -thick),
            (half, high),
            (inner, high),
            (inner, 0.0),
            (-inner, 0.0),
            (-inner, high),
            (-half, high),
        ];
        for y in [-half, half] {
            soup.vertices.extend(profile.map(|(x, z)| DVec3::new(x, y, z)));
        }
        for k in 0..8 {
            let next = (k + 1) % 8;
            soup.push_face(&[k, next, next + 8, k + 8]);
        }
        for [i, j, k, l] in [[0, 1, 4, 5], [1, 2, 3, 4], [0, 5, 6, 7]] {
            soup.push_face(&[l, k, j, i]);
            soup.push_face(&[i + 8, j + 8, k + 8, l + 8]);
        }
        build(&soup)
    }

    /// Sub-steps once took a depth that the query rejects, along a normal to a far edge.
    #[test]
    fn contacts_in_fast_ticks_are_near_the_probe() {
        const SEED: u64 = 0x6a2d_0001;
        let (mut random, table) = (Random::new(SEED), table());
        let probes = [DVec3::new(2e-3, 3e-3, 2e-4), DVec3::new(6e-3, 8e-3, 1e-3)].map(cuboid);
        let mut touched = 0;
        for throw in 0..6500 {
            let mut query = query(probes[throw % 2].clone(), table.clone(), true);
            let start = DVec3::new(0.04 * random.vector().x, 0.04 * random.vector().y, 3e-3);
            let (step, turn) = (random.vector() * 4e-3 - DVec3::Z * 1e-3, random.vector() * 0.5);
            for tick in 0..8 {
                let place = start + step * f64::from(tick);
                let pose = Pose::new(DQuat::from_scaled_axis(turn * f64::from(tick)), place);
                for contact in query.contacts(&pose) {
                    touched += 1;
                    // The guard may hold the probe far below the top.
                    let off = (contact.midpoint() - place).reject_from_normalized(DVec3::Z).length();
                    assert!(off < 0.02, "seed {SEED:#x}, throw {throw}, tick {tick}: {off} m, {contact:?}");
                }
            }
        }
        assert!(touched > 1000, "{touched}");
    }
}
