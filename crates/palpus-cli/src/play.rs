//! The play of close-fitting parts: how far one part can move to and fro in the other.
//!
//! Two contacts whose normals are opposite limit the motion along their normals. The sum of their
//! separations does not change when the part moves along the normals. So the play can be measured
//! at any pose near the fit, even if the parts overlap a little there.

use std::sync::Arc;

use palpus::algebra::{NoClock, Pose, Work};
use palpus::body::Body;
use palpus::detect::{Contact, ContactQuery, QuerySettings};

/// Work limit of the search, in units of [`Work`]; about a tenth of a second.
const MOST_WORK: u64 = 1_000_000;
/// Two normals are opposite if their cosine is below this.
const OPPOSITE: f64 = -0.9;

/// Returns the smallest sum (m) of the separations of two contacts with opposite normals. Only
/// contacts with a separation up to `within` (m) count. `pose_ba` places `a` in the frame of `b`.
///
/// `None` if there are no such contacts; if the bodies overlap by more than `within`, so that they
/// do not lie in each other with play; or if the search exceeds its work limit.
pub(crate) fn play(a: &Arc<Body>, b: &Arc<Body>, pose_ba: &Pose, within: f64) -> Option<f64> {
    let settings = QuerySettings { tolerance: within, capacity: 1 << 14, ..QuerySettings::default() };
    let mut query = ContactQuery::new(a.clone(), b.clone(), settings);
    let work = Work::of(Some(MOST_WORK));
    if query.run_within(pose_ba, &work.all(), &NoClock).traversal.postponed > 0 {
        return None;
    }
    let mut contacts = query.found().to_vec();
    contacts.sort_by(|one, other| one.separation.total_cmp(&other.separation));
    if contacts.first()?.separation < -within {
        return None;
    }
    least_opposite(&contacts)
}

/// Returns the smallest sum of two separations whose normals are opposite. The contacts are sorted
/// by separation.
fn least_opposite(contacts: &[Contact]) -> Option<f64> {
    let mut least = f64::INFINITY;
    for (k, one) in contacts.iter().enumerate() {
        for other in &contacts[k + 1..] {
            let sum = one.separation + other.separation;
            if sum >= least {
                break;
            }
            if one.normal.dot(other.normal) < OPPOSITE {
                least = sum;
            }
        }
    }
    least.is_finite().then_some(least)
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};
    use palpus::body::BodySettings;
    use palpus_scenes::shape;

    use super::*;
    use crate::bodies;

    fn body(name: &str, soup: &palpus::body::PolygonSoup) -> Arc<Body> {
        bodies::use_cache(false);
        let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
        Arc::new(bodies::prepare_soup(name, soup, &settings).expect("the body can be prepared").body)
    }

    #[test]
    fn play_of_a_peg_is_its_clearance() {
        let clearance = 2e-4;
        let (peg, hole) =
            (body("peg", &shape::disc(shape::PEG_RADIUS, 0.02, 32)), body("hole", &shape::hole_block(clearance)));
        // The play does not depend on where in the hole the peg is, even if it overlaps a little.
        for aside in [0.0, 0.4 * clearance, 0.6 * clearance] {
            let pose = Pose::new(DQuat::IDENTITY, DVec3::new(aside, 0.0, -0.0125));
            let found = play(&peg, &hole, &pose, 3e-4).expect("the peg has play");
            assert!((found / clearance - 1.0).abs() < 0.1, "{found} at {aside}");
        }
        let above = Pose::from_translation(DVec3::Z * 0.1);
        assert_eq!(play(&peg, &hole, &above, 3e-4), None);
    }

    #[test]
    fn parts_that_only_overlap_have_no_play() {
        let cube = body("cube", &shape::cuboid(DVec3::splat(0.02)));
        for height in [0.0, 0.01, 0.0199] {
            assert_eq!(play(&cube, &cube, &Pose::from_translation(DVec3::Z * height), 2e-4), None, "{height}");
        }
    }
}
