//! Whether a repaired depth is to be believed.
//!
//! A piece is thinner than the solid that it stands for, and a probe that has come in through the near wall of a thin part
//! overlaps the pieces of the far wall from behind. The walk then ends on a virtual face, and the repair (\[K02 §3.4\]) on
//! the far wall's outer surface: a depth of the whole probe, in the wrong direction. In a hand that is a kick.
//!
//! A depth D along n says that one body's witness point lies D inside the other. So it is believed only if
//!
//! 1. a's point lies inside b, and no surface of b is nearer than nearly D, or
//! 2. b's point lies inside a, and no surface of a is nearer than nearly D.
//!
//! Only repaired depths are asked: a depth that rests on original features comes with its own surface. A body that is not
//! closed has no inside to ask about and is believed.
//!
//! Deviation from \[K02\], which repairs without asking.

use glam::DVec3;

use super::Contact;
use crate::algebra::Placement;
use crate::algebra::tolerance::BELIEVED_SHARE;
use crate::body::Body;

/// True if the contact's depth is one that a solid can have there; `pose_ba` places a's frame in b's.
pub(super) fn is_believed(a: &Body, b: &Body, pose_ba: &Placement, contact: &Contact) -> bool {
    let depth = -contact.separation;
    if !a.mesh().is_closed() && !b.mesh().is_closed() {
        return true;
    }
    lies_within(b, contact.point_a, depth) || lies_within(a, pose_ba.inverse_point(contact.point_b), depth)
}

/// True if `point` (in the body's frame) is inside the body and about `depth` from its surface, or farther.
fn lies_within(body: &Body, point: DVec3, depth: f64) -> bool {
    body.mesh().is_closed()
        && body.tree().nearest_within(point, BELIEVED_SHARE * depth).is_none()
        && body.tree().inside(point)
}
