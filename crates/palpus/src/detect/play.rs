//! The play of close-fitting parts: how far one part can move to and fro in the other.
//!
//! 1. Find the contacts near a pose at which the parts fit.
//! 2. Move the part, without rotation, to the place at which its smallest separation is largest. A
//!    contact's separation changes by the motion along its normal. The part may begin anywhere in
//!    its play, and may overlap a little.
//! 3. The separation at that place is half of the play. If it is not limited, the parts do not fit:
//!    a ball in a groove can leave it.

use std::sync::Arc;

use glam::DVec3;

use super::{Contact, ContactQuery, QuerySettings};
use crate::algebra::tolerance::PLAY_WORK;
use crate::algebra::{NoClock, Pose, Work};
use crate::body::Body;

/// Work limit of each of the first queries, and their number. Bodies that overlap by more than a
/// little are found by them, without the whole search.
const GLANCE_WORK: u64 = PLAY_WORK / 100;
const GLANCES: usize = 4;
/// Largest motion to the middle of the play, as a multiple of the largest separation of contacts.
const REACH: f64 = 4.0;
/// The motion to the middle has this number of steps. The last step is this share of the first. The
/// result is at most some percent too small.
const STEPS: i32 = 1000;
const LAST_STEP: f64 = 1e-4;

/// Returns half of the play (m) of two parts. Only contacts with a separation up to `within` (m)
/// count. `pose_ba` places `a` in the frame of `b`. Negative if the parts fit so tightly that they
/// overlap.
///
/// `None` if the part can move until all separations are `within`; if the bodies overlap by more
/// than `within`, so that they do not lie in each other with play; or if the search exceeds its
/// work limit, `left`. The work of the search is subtracted from `left`.
pub(crate) fn half_play(a: &Arc<Body>, b: &Arc<Body>, pose_ba: &Pose, within: f64, left: &mut u64) -> Option<f64> {
    if *left == 0 || !are_near(a, b, pose_ba, within) {
        return None;
    }
    let settings = QuerySettings { tolerance: within, capacity: 1 << 14, ..QuerySettings::default() };
    let mut query = ContactQuery::new(a.clone(), b.clone(), settings);
    if has_no_play(&mut query, pose_ba, within, left) {
        return None;
    }
    // The contacts of a query may depend on its history, so the search has a query of its own.
    let mut query = ContactQuery::new(a.clone(), b.clone(), settings);
    if !is_whole(&mut query, pose_ba, *left, left) {
        return None;
    }
    let contacts = query.found();
    if contacts.iter().any(|contact| contact.separation < -within) {
        return None;
    }
    Some(widest(contacts, REACH * within)?).filter(|&half| half < within)
}

/// True if the boxes of two bodies are nearer than `margin` (m) along each axis of `b`.
fn are_near(a: &Body, b: &Body, pose_ba: &Pose, margin: f64) -> bool {
    a.mesh().bounds().placed(pose_ba).grown(margin).overlaps(&b.mesh().bounds())
}

/// True if the first queries find a contact that is deeper than `within` (m), or that there is no
/// contact.
fn has_no_play(query: &mut ContactQuery, pose_ba: &Pose, within: f64, left: &mut u64) -> bool {
    for _ in 0..GLANCES {
        let whole = is_whole(query, pose_ba, GLANCE_WORK, left);
        if query.found().iter().any(|contact| contact.separation < -within) {
            return true;
        }
        if whole {
            return query.found().is_empty();
        }
    }
    false
}

/// Runs a query with a work limit of `most` and `left` units. Returns true if it examined
/// everything. Its work is subtracted from `left`.
fn is_whole(query: &mut ContactQuery, pose_ba: &Pose, most: u64, left: &mut u64) -> bool {
    let work = Work::of(Some(most.min(*left)));
    let postponed = query.run_within(pose_ba, &work.all(), &NoClock).traversal.postponed;
    *left = left.saturating_sub(work.spent());
    postponed == 0
}

/// Returns the largest value of the smallest separation (m) for all translations up to `reach` (m).
/// `None` without contacts.
///
/// The smallest separation is a concave function of the translation. Each step moves away from the
/// nearest contact; steps get shorter.
fn widest(contacts: &[Contact], reach: f64) -> Option<f64> {
    let mut moved = DVec3::ZERO;
    let mut best = f64::NEG_INFINITY;
    for k in 0..STEPS {
        let separations =
            contacts.iter().map(|contact| (contact.separation + contact.normal.dot(moved), contact.normal));
        let (least, normal) = separations.min_by(|one, other| one.0.total_cmp(&other.0))?;
        best = best.max(least);
        let step = reach * LAST_STEP.powf(f64::from(k) / f64::from(STEPS));
        moved = (moved + step * normal).clamp_length_max(reach);
    }
    Some(best)
}
