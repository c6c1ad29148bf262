//! Tilt shares: the fraction with which each contact of a patch counts.
//!
//! Imagine the bodies pressed together and tilted a little, in any direction and by any slope up to
//! r. For each tilt, the bodies would rest on the lowest contact. The *tilt share* αᵢ of contact i
//! is the fraction of all tilts (by area in the disc of slopes) for which i is the lowest contact:
//!
//! cellᵢ = { s, |s| ≤ r : s·(xⱼ − xᵢ) ≤ dⱼ − dᵢ + eᵢⱼ for all j },  αᵢ = |cellᵢ| / (π r²),
//!
//! Here j runs over the corners of i's own patch, and of other patches with a corner at i's
//! position. x are the positions perpendicular to i's direction, d the separations, and e the
//! allowance described below. Without the allowance, the cells are a power diagram, and the shares
//! are the Monge–Ampère measure of the lower hull of the contacts. It follows:
//!
//! * The shares of a flush polygon's corners are proportional to their exterior angles. The
//!   weighted mean of the corners is the polygon's Steiner point, for example the middle of a line
//!   segment or of a rectangle.
//! * A common corner of patches of neighbouring pieces counts once. Its share is 0 if it lies
//!   inside the surface that the patches form together, or on the line between two corners. So if a
//!   flat surface is cut into pieces, its rim bears the load.
//! * Pieces overlap where the mesh is flat, and a corner of one piece may lie inside a side of
//!   another. So the patches alone do not show that a corner is inside a flat face. The query marks
//!   these contacts ([`Contact::inside`]), and the rim bears their load ([`rims`]).
//! * Patches without a common corner do not affect each other: each foot of a table has its own
//!   corners.
//! * A contact without a patch counts fully.
//! * The result does not depend on a frame or on the order of the contacts.
//!
//! **Continuity.** Each bound of a cell is continuous in both contacts, so the areas are continuous
//! too. If a corner splits in two, its cell splits. If a corner appears on the line between two
//! other corners, its cell is empty. So sums over all contacts are continuous even if the number of
//! contacts changes.
//!
//! **The allowance.** e = |x| (|nᵢ × nⱼ| + r (max(1 − wⱼ/wᵢ, 0))³). The first term keeps contacts
//! with different directions from affecting each other, because they belong to different surfaces.
//! The second term keeps a contact without load from taking a share from a loaded contact. Without
//! it, the top of a slightly crowned face would lose its load to corners in the air. The cube makes
//! the second term small for similar loads. A stronger dependence on loads would oscillate, because
//! the tool's step uses the shares of the last tick.

mod rims;

use std::f64::consts::PI;
use std::ops::Range;

use glam::{DVec2, DVec3};

use self::rims::Rims;
use crate::algebra::tolerance::{TILT_INSIDE, TILT_SAME};
use crate::detect::Contact;

/// Data of a contact for the tilt shares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilted {
    /// Position, b's frame.
    pub place: DVec3,
    /// Unit direction in which the contact pushes a.
    pub direction: DVec3,
    /// Separation, m; negative where the bodies overlap.
    pub separation: f64,
    /// w, the engagement, m: 0 for a contact that does not push yet.
    pub engagement: f64,
    /// r, the largest slope of the tilts (tangent of the tilt angle). 0 for a contact without a
    /// patch.
    pub slope: f64,
    /// [`Contact::count`].
    pub count: f64,
    /// The pieces of a and b: contacts with equal pieces are corners of one patch.
    pub pieces: [u32; 2],
    /// [`Contact::inside`].
    pub inside: bool,
}

impl Tilted {
    /// Returns the data of a contact that pushes along its normal below a separation of
    /// `contact_offset` (m).
    pub fn of(contact: &Contact, contact_offset: f64) -> Self {
        Self { engagement: (contact_offset - contact.separation).max(0.0), ..Self::unloaded(contact) }
    }

    /// Returns the data of a contact for tilt shares that depend only on geometry.
    pub(crate) fn unloaded(contact: &Contact) -> Self {
        Self {
            place: contact.midpoint(),
            direction: contact.normal,
            separation: contact.separation,
            engagement: 0.0,
            slope: contact.slope,
            count: contact.count,
            pieces: [contact.piece_a, contact.piece_b],
            inside: contact.inside,
        }
    }
}

/// The tilt shares of a set of contacts, and the memory to compute them.
///
/// Corners of one patch are adjacent in the set.
#[derive(Clone, Debug)]
pub struct TiltShares {
    /// The coordinate along [`ALONG`] and the index of each contact with a patch. The list is
    /// sorted, so contacts at one position are near each other in it.
    sorted: Vec<(f64, u32)>,
    /// The place of each contact in `sorted`.
    places: Vec<u32>,
    /// Begin and end of the patch of each contact.
    patches: Vec<[u32; 2]>,
    shares: Vec<f64>,
    /// The position of each contact of the last run.
    positions: Vec<Position>,
    rims: Rims,
    cell: Cell,
}

/// The position of a contact.
#[derive(Clone, Copy, Debug)]
struct Position {
    /// True if no other patch has a corner at this position.
    alone: bool,
    /// [`Tilted::inside`] of any contact at this position.
    inside: bool,
}

/// A cell, in units in which the disc of slopes has radius 1. It starts as the square around the
/// disc and is clipped.
#[derive(Clone, Debug)]
struct Cell {
    /// The corners before and after the last cut.
    corners: [[DVec2; Self::ROOM]; 2],
    /// Index of the current list in `corners`.
    now: usize,
    count: usize,
}

/// A direction that is hardly a normal of a mesh, so few contacts have equal coordinates along it.
/// Its length is at most 1.
const ALONG: DVec3 = DVec3::new(0.6180, 0.5437, 0.5671);

/// Effect of a contact on the cell of another contact.
enum Bound {
    /// Nothing.
    None,
    /// Removes the whole cell.
    All,
    /// Keeps the part where `normal · s ≤ offset`.
    Half { normal: DVec2, offset: f64 },
}

/// Largest number of patches that are considered at one corner; further patches are ignored.
const MEET: usize = 8;

/// The patches that meet at a corner.
struct PatchesAtCorner {
    patches: [[u32; 2]; MEET],
    count: usize,
    /// True if the corner is inside a flat face.
    inside: bool,
}

impl TiltShares {
    /// Allocates memory for `capacity` contacts.
    pub fn new(capacity: usize) -> Self {
        Self {
            sorted: Vec::with_capacity(capacity),
            places: Vec::with_capacity(capacity),
            patches: Vec::with_capacity(capacity),
            shares: Vec::with_capacity(capacity),
            positions: Vec::with_capacity(capacity),
            rims: Rims::new(capacity),
            cell: Cell::EMPTY,
        }
    }

    /// Computes the tilt share of each of the `contacts`, from 0 to 1.
    pub fn run(&mut self, contacts: &[Tilted]) -> &[f64] {
        self.prepare(contacts);
        self.positions.clear();
        self.shares.clear();
        for i in 0..contacts.len() {
            let (share, position) = self.find(i, contacts);
            self.shares.push(share);
            self.positions.push(position);
        }
        &self.shares
    }

    /// Returns the tilt share of contact `i` of the last run of these `contacts`, reduced if the
    /// rim of a flat face bears the contact's load.
    pub(super) fn beside_rim(&mut self, i: usize, contacts: &[Tilted]) -> f64 {
        let share = self.shares[i];
        if self.positions[i].inside { share * self.rims.part(&contacts[i]) } else { share }
    }

    /// Prepares [`Self::share_of`] for these contacts.
    pub(super) fn prepare(&mut self, contacts: &[Tilted]) {
        self.rims.prepare(contacts);
        self.patches.clear();
        for patch in contacts.chunk_by(|one, other| one.slope > 0.0 && one.pieces == other.pieces) {
            let first = self.patches.len() as u32;
            let range = [first, first + patch.len() as u32];
            self.patches.extend(patch.iter().map(|_| range));
        }
        self.sorted.clear();
        let of_patch = contacts.iter().enumerate().filter(|(_, contact)| contact.slope > 0.0);
        self.sorted.extend(of_patch.map(|(i, contact)| (ALONG.dot(contact.place), i as u32)));
        self.sorted.sort_unstable_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        self.places.clear();
        self.places.resize(contacts.len(), 0);
        for (k, &(_, i)) in self.sorted.iter().enumerate() {
            self.places[i as usize] = k as u32;
        }
    }

    /// Returns the tilt share of contact `i` of the prepared `contacts`, reduced as in
    /// [`Self::beside_rim`]; 0 if the rim bears the whole load.
    pub(super) fn share_of(&mut self, i: usize, contacts: &[Tilted]) -> f64 {
        if contacts[i].slope <= 0.0 {
            return 1.0;
        }
        let Some(at) = self.patches_at(i, contacts) else { return 0.0 };
        let part = if at.inside { self.rims.part(&contacts[i]) } else { 1.0 };
        if part > TILT_INSIDE { part * self.share(i, &at, contacts) } else { 0.0 }
    }

    /// Returns true if other contacts bear the load of contact `i` of the prepared `contacts`. This
    /// contact is inside a flat face.
    pub(super) fn is_borne(&mut self, i: usize, contacts: &[Tilted]) -> bool {
        match self.patches_at(i, contacts) {
            Some(at) => at.inside && self.rims.part(&contacts[i]) <= TILT_INSIDE,
            None => true,
        }
    }

    fn find(&mut self, i: usize, contacts: &[Tilted]) -> (f64, Position) {
        if contacts[i].slope <= 0.0 {
            return (1.0, Position { alone: true, inside: false });
        }
        match self.patches_at(i, contacts) {
            None => (0.0, Position { alone: false, inside: false }),
            Some(at) => (self.share(i, &at, contacts), Position { alone: at.count == 1, inside: at.inside }),
        }
    }

    /// Returns the shares of one whole patch of the last run, if they are the shares that the patch
    /// would have without all other patches.
    pub(super) fn of_patch(&self, patch: Range<usize>) -> Option<&[f64]> {
        self.positions[patch.clone()].iter().all(|position| position.alone).then(|| &self.shares[patch])
    }

    /// Returns the shares of the last run.
    pub fn shares(&self) -> &[f64] {
        &self.shares
    }

    /// Returns the patches with a corner at the position of contact `i`. `None` if another contact
    /// represents this position: a deeper contact, or an earlier contact of equal depth.
    fn patches_at(&self, i: usize, contacts: &[Tilted]) -> Option<PatchesAtCorner> {
        let (one, k) = (&contacts[i], self.places[i] as usize);
        let mut at_corner = PatchesAtCorner { patches: [self.patches[i]; MEET], count: 1, inside: one.inside };
        let same = TILT_SAME * one.place.length();
        let here = self.sorted[k].0;
        let near = |other: &&(f64, u32)| (other.0 - here).abs() <= same;
        let (before, after) = (self.sorted[..k].iter().rev(), self.sorted[k + 1..].iter());
        for &(_, j) in before.take_while(near).chain(after.take_while(near)) {
            let j = j as usize;
            let other = &contacts[j];
            if !is_at(one, other)
                || one.direction.dot(other.direction) <= 0.0
                || one.direction.cross(other.direction).length() >= one.slope
            {
                continue;
            }
            if other.separation < one.separation || other.separation == one.separation && j < i {
                return None;
            }
            at_corner.add(self.patches[j]);
            at_corner.inside &= other.inside;
        }
        Some(at_corner)
    }

    /// Returns the share of contact `i` among the corners of the patches `at_corner`.
    fn share(&mut self, i: usize, at_corner: &PatchesAtCorner, contacts: &[Tilted]) -> f64 {
        let one = &contacts[i];
        let mut axes = None;
        self.cell.reset();
        for &[start, end] in &at_corner.patches[..at_corner.count] {
            for other in &contacts[start as usize..end as usize] {
                if is_at(one, other) {
                    continue;
                }
                let axes = axes.get_or_insert_with(|| one.direction.any_orthonormal_pair());
                match bound(one, other, [axes.0, axes.1]) {
                    Bound::None => {}
                    Bound::All => return 0.0,
                    Bound::Half { normal, offset } => self.cell.cut(normal, offset),
                }
                if self.cell.count == 0 {
                    return 0.0;
                }
            }
        }
        self.cell.share()
    }
}

impl PatchesAtCorner {
    fn add(&mut self, patch: [u32; 2]) {
        if self.count < MEET && !self.patches[..self.count].contains(&patch) {
            self.patches[self.count] = patch;
            self.count += 1;
        }
    }
}

/// Returns true if both contacts are at one position.
fn is_at(one: &Tilted, other: &Tilted) -> bool {
    other.place.distance_squared(one.place) <= TILT_SAME * TILT_SAME * one.place.length_squared()
}

fn bound(one: &Tilted, other: &Tilted, [x, y]: [DVec3; 2]) -> Bound {
    let between = other.place - one.place;
    let across = DVec2::new(x.dot(between), y.dot(between));
    let higher = other.separation - one.separation;
    let squared = across.length_squared();
    // Most contacts end here, without a root.
    let is_high = higher >= 0.0 && higher * higher >= one.slope * one.slope * squared;
    if is_high || one.direction.dot(other.direction) <= 0.0 {
        return Bound::None;
    }
    let length = squared.sqrt();
    let reach = one.slope * length;
    let lighter = if one.engagement > 0.0 { (1.0 - other.engagement / one.engagement).max(0.0) } else { 0.0 };
    let (higher, lighter) = (higher / reach, lighter * lighter * lighter);
    // The sum in another order differs only in its rounding.
    if higher + lighter >= 1.0 + f64::EPSILON * 4.0 {
        return Bound::None;
    }
    let turned = if one.direction == other.direction { 0.0 } else { one.direction.cross(other.direction).length() };
    let offset = higher + turned / one.slope + lighter;
    if offset >= 1.0 {
        Bound::None
    } else if offset <= -1.0 {
        Bound::All
    } else {
        Bound::Half { normal: across / length, offset }
    }
}

impl Cell {
    /// Largest number of corners of a cell; a cut that would exceed it is skipped.
    const MOST: usize = 32;

    /// Room for the corners, and for one value that [`Self::cut`] writes and does not keep.
    const ROOM: usize = Self::MOST + 1;

    const EMPTY: Self = Self { corners: [[DVec2::ZERO; Self::ROOM]; 2], now: 0, count: 0 };

    /// Resets the cell to the whole square.
    fn reset(&mut self) {
        for (corner, [x, y]) in
            self.corners[self.now].iter_mut().zip([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        {
            *corner = DVec2::new(x, y);
        }
        self.count = 4;
    }

    fn cut(&mut self, normal: DVec2, offset: f64) {
        let [first, second] = &mut self.corners;
        let (old, new) = if self.now == 0 { (first, second) } else { (second, first) };
        let old = &old[..self.count];
        let mut below = [0.0; Self::MOST];
        let mut least = 0.0;
        for (below, p) in below.iter_mut().zip(old) {
            *below = offset - normal.dot(*p);
            least = if *below < least { *below } else { least };
        }
        if least >= 0.0 || old.len() + 1 > Self::MOST {
            return;
        }
        // Which sides are cut is hard to predict, so both points are computed for each side, and
        // written over if they do not belong to the cell.
        let mut count = 0;
        let (mut from, mut from_below) = (old[old.len() - 1], below[old.len() - 1]);
        for (&to, &to_below) in old.iter().zip(&below) {
            new[count] = from.lerp(to, from_below / (from_below - to_below));
            count += usize::from((from_below < 0.0) != (to_below < 0.0));
            new[count] = to;
            count += usize::from(to_below >= 0.0);
            (from, from_below) = (to, to_below);
        }
        (self.count, self.now) = (count, 1 - self.now);
    }

    /// Returns the cell's area within the unit disc, divided by the area of the disc. The area is a
    /// sum of triangles and sectors. A triangle connects the origin with the part of a side in the
    /// disc. A sector lies between the point where a side leaves the disc and the point where the
    /// next side enters the disc.
    fn share(&self) -> f64 {
        let corners = &self.corners[self.now][..self.count];
        let mut twice = 0.0;
        let (mut first, mut last) = (None, None);
        for (k, &from) in corners.iter().enumerate() {
            let to = corners[if k + 1 == corners.len() { 0 } else { k + 1 }];
            let Some([enters, leaves]) = within_disc(from, to) else { continue };
            twice += enters.perp_dot(leaves) + last.map_or(0.0, |last| sector(last, enters));
            first.get_or_insert(enters);
            last = Some(leaves);
        }
        twice += match (last, first) {
            (Some(last), Some(first)) => sector(last, first),
            // If no side of the cell crosses the disc, the cell contains the whole disc or
            // nothing of it.
            _ if self.holds_origin() => 2.0 * PI,
            _ => 0.0,
        };
        (0.5 * twice / PI).clamp(0.0, 1.0)
    }

    fn holds_origin(&self) -> bool {
        let corners = &self.corners[self.now][..self.count];
        let next = corners.iter().cycle().skip(1);
        !corners.is_empty() && corners.iter().zip(next).all(|(p, q)| p.perp_dot(*q) > 0.0)
    }
}

/// Returns the part of the segment from `p` to `q` that is in the unit disc.
fn within_disc(p: DVec2, q: DVec2) -> Option<[DVec2; 2]> {
    let along = q - p;
    let squared = along.length_squared();
    if squared <= 0.0 {
        return None;
    }
    // Most sides end here, without a root.
    let inside = |p: DVec2| p.length_squared() < INSIDE;
    if inside(p) && inside(q) {
        return Some([p, q]);
    }
    // Parameters at which the line enters and leaves the disc, relative to its length.
    let middle = -p.dot(along) / squared;
    let reach = middle * middle - (p.length_squared() - 1.0) / squared;
    if reach * squared <= GRAZE * GRAZE {
        return None;
    }
    let (enters, leaves) = (middle - reach.sqrt(), middle + reach.sqrt());
    let at = |share: f64| {
        if share <= 0.0 {
            p
        } else if share >= 1.0 {
            q
        } else {
            p + along * share
        }
    };
    (leaves > 0.0 && enters < 1.0).then(|| [at(enters), at(leaves)])
}

/// A line whose part in the disc is shorter than twice this (relative to the disc's radius) cuts
/// nothing off.
const GRAZE: f64 = 1e-7;

/// A point with a squared distance from the origin below this is inside the disc, with a margin for
/// rounding.
const INSIDE: f64 = 0.99;

/// Returns twice the area of the disc between two directions, counterclockwise from `p` to `q`. If
/// the directions are nearly equal, rounding hides their order. Then the area is 0 and not the
/// whole disc, since a part that is cut off is at least as wide as [`GRAZE`].
fn sector(p: DVec2, q: DVec2) -> f64 {
    if p == q {
        return 0.0;
    }
    let angle = p.perp_dot(q).atan2(p.dot(q));
    if angle < -0.1 * GRAZE { angle + 2.0 * PI } else { angle.max(0.0) }
}

#[cfg(test)]
mod tests;
