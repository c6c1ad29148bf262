//! Chooses the contact tolerance for bodies.
//!
//! 1. The tolerance is at most 1 mm and a hundredth of the smaller body's size.
//! 2. If a part fits closely into another, the tolerance is at most half of its play. With a larger
//!    tolerance, contacts would push from all sides at once, also where the part is in the middle.

use std::sync::Arc;

use crate::algebra::Pose;
use crate::algebra::tolerance::{DEFAULT_TOLERANCE, LEAST_BY_PLAY, PLAY_WORK, TOLERANCE_SHARE};
use crate::body::Body;
use crate::detect::half_play;

/// Returns a contact tolerance (m) for two bodies, for
/// [`Settings::coupled`](super::Settings::coupled): the smallest of 1 mm, a hundredth of the
/// smaller body's size, and half of the play of the bodies.
///
/// `pose_ba` is the pose of `a` in the frame of `b`. If the bodies are parts that fit into each
/// other, give a pose at which they do; elsewhere they have no play. Close-fitting parts take up to
/// a second, others much less. If more than two bodies can touch each other, take the smallest
/// value of all pairs, or use [`tolerance_by_play`]. Lengths of bodies must be in metres.
///
/// ```
/// use std::sync::Arc;
/// use palpus::{Body, Limits, Pose, Settings, contact_tolerance, glam::DVec3};
///
/// let corners = [DVec3::ZERO, 0.05 * DVec3::X, 0.05 * DVec3::Y, 0.05 * DVec3::Z];
/// let body = Arc::new(Body::from_convex(&corners)?);
/// let tolerance = contact_tolerance(&body, &body, &Pose::from_translation(0.1 * DVec3::Z));
/// let settings = Settings::coupled(Limits { force: 8.5, torque: 0.19 }, 1e-3, tolerance);
/// assert_eq!(settings.contact_tolerance, 0.01 * body.size());
/// # Ok::<(), palpus::BodyError>(())
/// ```
pub fn contact_tolerance(a: &Arc<Body>, b: &Arc<Body>, pose_ba: &Pose) -> f64 {
    tolerance_by_play(tolerance_by_size(a, b), [(a, b, *pose_ba)])
}

/// Returns a contact tolerance (m) for two bodies without play: the smaller of 1 mm and a hundredth
/// of the smaller body's size.
pub fn tolerance_by_size(a: &Body, b: &Body) -> f64 {
    DEFAULT_TOLERANCE.min(TOLERANCE_SHARE * a.size().min(b.size()))
}

/// Lowers the contact tolerance `most` (m) to half of the least play of these pairs of bodies, but
/// not below a twentieth of `most`. Each pose is that of the first body in the frame of the second.
///
/// The search for the play of all pairs takes about a second at most. Later pairs are ignored then.
pub fn tolerance_by_play<'a>(most: f64, pairs: impl IntoIterator<Item = (&'a Arc<Body>, &'a Arc<Body>, Pose)>) -> f64 {
    let mut left = PLAY_WORK;
    let halves = pairs.into_iter().filter_map(|(a, b, pose_ba)| half_play(a, b, &pose_ba, most, &mut left));
    halves.fold(most, |least, half| least.min(half)).max(LEAST_BY_PLAY * most)
}
