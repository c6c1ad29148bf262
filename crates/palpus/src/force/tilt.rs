//! Tilt shares: how much each contact counts in the patch that it belongs to.
//!
//! Imagine the bodies pressed together and tilted a little, in any direction and by any slope up to
//! r. For each tilt they would stand on one contact: the one that is lowest then. The *tilt share* αᵢ
//! of contact i is the share of tilts, by area of the disc of slopes, for which that is i:
//!
//! cellᵢ = { s, |s| ≤ r : s·(xⱼ − xᵢ) ≤ dⱼ − dᵢ + eᵢⱼ for all j },  αᵢ = |cellᵢ| / (π r²),
//!
//! where j runs over the corners of i's own patch and of the patches that share i's corner with it,
//! with x the places across i's direction, d the separations, and the allowance e, see below. Without it
//! the cells are a power diagram, and the shares the Monge–Ampère measure of the lower hull of the
//! contacts. So:
//!
//! * The corners of a flush polygon count by their exterior angle, and their mean is its Steiner point:
//!   the middle of a stretch or of a rectangle.
//! * A corner that patches of neighbouring pieces share counts once, and for nothing inside the surface that they make up or on
//!   the line between two corners: where a flat surface is cut into pieces, its rim bears the load.
//! * Patches that do not meet know nothing of each other: each foot of a table has corners of its own.
//! * A contact without a patch counts fully.
//! * No frame and no order enter.
//!
//! **Continuity.** Each bound of a cell is continuous in both contacts, so the areas are. A corner that
//! splits in two splits its cell, one that appears on the line between two has an empty one; so what
//! the shares say of places is continuous even where the number of contacts changes.
//!
//! **The allowance.** e = |x| (|nᵢ × nⱼ| + r (1 − wⱼ/wᵢ)³₊): contacts that push along other directions
//! are other surfaces, and a contact that bears no load takes no share from one that does. Without the
//! second part the top of a slightly crowned face would lose its load to corners that are not touching.
//! The cube leaves contacts with similar loads alone: shares are those of the last tick to the tool's step, and
//! one that answered loads strongly would swing.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::algebra::tolerance::TILT_SAME;

/// What a contact brings to the tilt shares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilted {
    /// Where it is, b's frame.
    pub place: DVec3,
    /// Unit: where it pushes a.
    pub direction: DVec3,
    /// m, negative where the bodies overlap.
    pub separation: f64,
    /// w, m: 0 for one that does not push yet.
    pub engagement: f64,
    /// r, tangent: contacts within tilts of this slope are known; 0 for a contact without a patch.
    pub slope: f64,
    /// The pieces of a and b: contacts of the same two are corners of one patch.
    pub pieces: [u32; 2],
}

/// A cell in units of the slope, clipped from the square about the disc.
struct Cell {
    corners: [DVec2; Self::MOST],
    count: usize,
}

/// What a contact does to another's cell.
enum Bound {
    /// Nothing.
    None,
    /// Takes all of it.
    All,
    /// Leaves the part where `normal · s ≤ offset`.
    Half { normal: DVec2, offset: f64 },
}

/// The tilt share of contact `i`, from 0 to 1, among `contacts`.
pub fn tilt_share(i: usize, contacts: &[Tilted]) -> f64 {
    let one = &contacts[i];
    if one.slope <= 0.0 {
        return 1.0;
    }
    let Some(met) = met(i, contacts) else { return 0.0 };
    let mut axes = None;
    let mut cell = Cell::whole();
    for other in contacts.iter().filter(|other| met.contains(&other.pieces) && !is_at(one, other)) {
        let axes = axes.get_or_insert_with(|| one.direction.any_orthonormal_pair());
        match bound(one, other, [axes.0, axes.1]) {
            Bound::None => {}
            Bound::All => return 0.0,
            Bound::Half { normal, offset } => cell.cut(normal, offset),
        }
    }
    cell.share()
}

/// Patches that may meet at a corner; of more, the first.
const MEET: usize = 8;

/// The patches that have a corner where contact `i` is; `None` if the corner of one of them stands for it, being deeper, or
/// as deep and the first.
fn met(i: usize, contacts: &[Tilted]) -> Option<[[u32; 2]; MEET]> {
    let one = &contacts[i];
    let mut met = [one.pieces; MEET];
    let mut count = 1;
    for (j, other) in contacts.iter().enumerate() {
        if j == i || !is_at(one, other) || other.slope <= 0.0 {
            continue;
        }
        if one.direction.dot(other.direction) <= 0.0 || one.direction.cross(other.direction).length() >= one.slope {
            continue;
        }
        if other.separation < one.separation || other.separation == one.separation && j < i {
            return None;
        }
        if count < MEET {
            met[count] = other.pieces;
            count += 1;
        }
    }
    Some(met)
}

/// True if both are at one place.
fn is_at(one: &Tilted, other: &Tilted) -> bool {
    other.place.distance_squared(one.place) <= TILT_SAME * TILT_SAME * one.place.length_squared()
}

fn bound(one: &Tilted, other: &Tilted, [x, y]: [DVec3; 2]) -> Bound {
    let between = other.place - one.place;
    let across = DVec2::new(x.dot(between), y.dot(between));
    let length = across.length();
    let higher = other.separation - one.separation;
    let reach = one.slope * length;
    if higher >= reach || one.direction.dot(other.direction) <= 0.0 {
        return Bound::None;
    }
    let turned = one.direction.cross(other.direction).length();
    let lighter = if one.engagement > 0.0 { (1.0 - other.engagement / one.engagement).max(0.0) } else { 0.0 };
    let offset = higher / reach + turned / one.slope + lighter * lighter * lighter;
    if offset >= 1.0 {
        Bound::None
    } else if offset <= -1.0 {
        Bound::All
    } else {
        Bound::Half { normal: across / length, offset }
    }
}

impl Cell {
    /// Corners that a cell may have; a cut beyond is left out.
    const MOST: usize = 32;

    fn whole() -> Self {
        let mut corners = [DVec2::ZERO; Self::MOST];
        for (corner, [x, y]) in corners.iter_mut().zip([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) {
            *corner = DVec2::new(x, y);
        }
        Self { corners, count: 4 }
    }

    fn cut(&mut self, normal: DVec2, offset: f64) {
        let below = |p: DVec2| offset - normal.dot(p);
        let old = self.corners;
        let count = self.count;
        if count == 0 || count + 1 > Self::MOST || old[..count].iter().all(|&p| below(p) >= 0.0) {
            return;
        }
        self.count = 0;
        let mut from = old[count - 1];
        let mut from_below = below(from);
        for &to in &old[..count] {
            let to_below = below(to);
            if (from_below < 0.0) != (to_below < 0.0) {
                self.corners[self.count] = from.lerp(to, from_below / (from_below - to_below));
                self.count += 1;
            }
            if to_below >= 0.0 {
                self.corners[self.count] = to;
                self.count += 1;
            }
            (from, from_below) = (to, to_below);
        }
    }

    /// The area within the unit disc, over that of the disc.
    fn share(&self) -> f64 {
        let corners = &self.corners[..self.count];
        let twice: f64 = (0..self.count).map(|k| twice_within_disc(corners[k], corners[(k + 1) % self.count])).sum();
        (0.5 * twice / PI).clamp(0.0, 1.0)
    }
}

/// Twice the signed area of the unit disc's part in the triangle from the origin to `p` and `q`.
fn twice_within_disc(p: DVec2, q: DVec2) -> f64 {
    let along = q - p;
    let squared = along.length_squared();
    let sector = |p: DVec2, q: DVec2| p.perp_dot(q).atan2(p.dot(q));
    if squared <= 0.0 {
        return 0.0;
    }
    // Where the line enters and leaves the disc, as shares of the way from p to q.
    let middle = -p.dot(along) / squared;
    let reach = middle * middle - (p.length_squared() - 1.0) / squared;
    if reach <= 0.0 {
        return sector(p, q);
    }
    let (enters, leaves) = (middle - reach.sqrt(), middle + reach.sqrt());
    if leaves <= 0.0 || enters >= 1.0 {
        return sector(p, q);
    }
    let (first, last) = (p + along * enters.max(0.0), p + along * leaves.min(1.0));
    let mut twice = first.perp_dot(last);
    if enters > 0.0 {
        twice += sector(p, first);
    }
    if leaves < 1.0 {
        twice += sector(last, q);
    }
    twice
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;

    const SEED: u64 = 0x7117;
    const SLOPE: f64 = 0.0875;

    fn at(x: f64, y: f64, separation: f64) -> Tilted {
        Tilted {
            place: DVec3::new(x, y, 0.0),
            direction: DVec3::Z,
            separation,
            engagement: (1e-4 - separation).max(0.0),
            slope: SLOPE,
            pieces: [0; 2],
        }
    }

    fn shares(contacts: &[Tilted]) -> Vec<f64> {
        (0..contacts.len()).map(|i| tilt_share(i, contacts)).collect()
    }

    fn close(found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len());
        for (x, y) in found.iter().zip(expected) {
            assert!((x - y).abs() < 1e-9, "{found:?}, expected {expected:?}");
        }
    }

    #[test]
    fn corners_count_by_exterior_angle() {
        close(&shares(&[at(0.0, 0.0, 0.0)]), &[1.0]);
        close(&shares(&[at(0.0, 0.0, 0.0), at(0.02, 0.0, 0.0)]), &[0.5; 2]);
        let box_corners = [at(0.0, 0.0, 0.0), at(0.04, 0.0, 0.0), at(0.04, 0.01, 0.0), at(0.0, 0.01, 0.0)];
        close(&shares(&box_corners), &[0.25; 4]);
        // A right angle and two of 45°.
        let triangle = [at(0.0, 0.0, 0.0), at(0.01, 0.0, 0.0), at(0.0, 0.01, 0.0)];
        close(&shares(&triangle), &[0.25, 0.375, 0.375]);
    }

    #[test]
    fn inner_and_double_contacts_count_for_nothing() {
        let flat = [
            at(0.0, 0.0, 0.0),
            at(0.04, 0.0, 0.0),
            at(0.04, 0.02, 0.0),
            at(0.0, 0.02, 0.0),
            at(0.02, 0.01, 0.0),
            at(0.02, 0.0, 0.0),
            at(0.04, 0.0, 0.0),
        ];
        close(&shares(&flat), &[0.25, 0.25, 0.25, 0.25, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn a_face_in_two_pieces_is_borne_by_its_rim() {
        let half = |x: f64, piece: u32| {
            [(x, 0.0), (x + 0.02, 0.0), (x + 0.02, 0.02), (x, 0.02)]
                .map(|(x, y)| Tilted { pieces: [0, piece], ..at(x, y, 0.0) })
        };
        let [near, beside, far] = [half(0.0, 1), half(0.02, 2), half(0.03, 3)];
        close(&shares(&[near, beside].concat()), &[0.25, 0.0, 0.0, 0.25, 0.0, 0.25, 0.25, 0.0]);
        // Two feet that stand apart have four corners each.
        close(&shares(&[near, far].concat()), &[0.25; 8]);
    }

    #[test]
    fn other_directions_count_by_themselves() {
        let mut corner = [at(0.0, 0.0, 0.0), at(0.01, 0.0, 0.0)];
        corner[1].direction = DVec3::X;
        close(&shares(&corner), &[1.0, 1.0]);
        corner[1].direction = -DVec3::Z;
        close(&shares(&corner), &[1.0, 1.0]);
    }

    #[test]
    fn a_deep_contact_keeps_its_share_from_those_without_load() {
        // A crown of 0.02 mm over 20 mm: corners lie above the top.
        let mut crown = [at(0.0, 0.0, 0.0); 5];
        for (k, corner) in crown.iter_mut().skip(1).enumerate() {
            let sign = |bit: usize| if k >> bit & 1 == 1 { 0.01 } else { -0.01 };
            *corner = at(sign(0), sign(1), 2e-5);
            corner.engagement = 0.0;
        }
        crown[0].engagement = 2e-5;
        assert!((tilt_share(0, &crown) - 1.0).abs() < 1e-12);
        // Loaded alike, the corners bear nearly all.
        crown.iter_mut().for_each(|contact| contact.engagement = 1e-3);
        assert!(tilt_share(0, &crown) < 0.01);
    }

    #[test]
    fn shares_are_continuous_where_a_corner_splits() {
        let square = |cut: f64| {
            vec![
                at(0.0, 0.0, 0.0),
                at(0.02 - cut, 0.0, 0.0),
                at(0.02, cut, 0.0),
                at(0.02, 0.02, 0.0),
                at(0.0, 0.02, 0.0),
            ]
        };
        let mean = |contacts: &[Tilted]| -> DVec3 {
            let shares = shares(contacts);
            contacts.iter().zip(&shares).map(|(contact, share)| contact.place * *share).sum()
        };
        let whole = mean(&[at(0.0, 0.0, 0.0), at(0.02, 0.0, 0.0), at(0.02, 0.02, 0.0), at(0.0, 0.02, 0.0)]);
        for cut in [1e-12, 1e-9, 1e-6, 1e-5] {
            assert!(mean(&square(cut)).distance(whole) <= cut, "{cut}");
        }
    }

    #[test]
    fn shares_of_a_patch_sum_to_one_and_turn_with_it() {
        let mut random = Random(SEED);
        for round in 0..300 {
            let count = 2 + random.below(10);
            let mut contacts: Vec<Tilted> = (0..count)
                .map(|_| at(random.between(-0.02, 0.02), random.between(-0.02, 0.02), random.between(0.0, 3e-4)))
                .collect();
            contacts.iter_mut().for_each(|contact| contact.engagement = 0.0);
            let before = shares(&contacts);
            assert!((before.iter().sum::<f64>() - 1.0).abs() < 1e-9, "seed {SEED:#x}, round {round}: {before:?}");
            let pose = random.pose(0.1);
            for contact in &mut contacts {
                contact.place = pose.point(contact.place);
                contact.direction = pose.vector(contact.direction);
            }
            let after = shares(&contacts);
            assert!(before.iter().zip(&after).all(|(x, y)| (x - y).abs() < 1e-8), "seed {SEED:#x}, round {round}");
        }
    }
}
