//! Finds short free translations, which give the upper bound.
//!
//! * *Project* finds a free translation beside a blocked translation x. It tests the translation
//!   nearest to x that lies in all half-spaces found so far. While an obstacle blocks that
//!   translation, *project* adds the half-space beyond the obstacle's facet that seems nearest.
//! * *Slide* shortens a free translation g to a local minimum. It tests the translation nearest to
//!   the origin that lies in all half-spaces found so far (none at the start). While an obstacle
//!   blocks that translation, *slide* adds the half-space beyond the facet through which the line
//!   to g leaves the obstacle. All half-spaces contain g, so the result is free and not longer than
//!   g. The method follows G. Je and others, *PolyDepth*, 2012, with exact obstacles in place of
//!   local contact planes.

use glam::DVec3;

use super::half_spaces::{HalfSpace, nearest_common};
use super::scene::{Candidates, Place, Scene};
use crate::algebra::tolerance::{DEPTH_PROJECT_STEPS, DEPTH_SLIDE_STEPS};

/// Returns a free translation near `x` that is shorter than `limit`. `None` if the search finds no
/// translation.
pub(super) fn project(scene: &mut Scene<'_>, x: DVec3, limit: f64) -> Option<DVec3> {
    let mut spaces: Vec<HalfSpace> = Vec::new();
    let mut t = x;
    for _ in 0..DEPTH_PROJECT_STEPS {
        match scene.classify(Candidates::All, t) {
            Place::Free => return Some(t),
            Place::Unclear => return None,
            Place::Blocked(k) => {
                let exit = scene.obstacle(k).nearest_exit(t)?;
                // The half-spaces are relative to x, so the result is the point nearest to x.
                let offset = exit.offset + scene.hair - exit.normal.dot(x);
                spaces.push(HalfSpace { normal: exit.normal, offset });
            }
        }
        t = x + nearest_common(&spaces, 1e-3 * scene.hair)?;
        if t.length() >= limit {
            return None;
        }
    }
    None
}

/// Returns a free translation that is not longer than `free`. The result is a local minimum unless
/// the search reaches its limit of steps.
pub(super) fn slide(scene: &mut Scene<'_>, free: DVec3) -> DVec3 {
    let mut spaces: Vec<HalfSpace> = Vec::new();
    let mut t = DVec3::ZERO;
    let slack = 1e-3 * scene.hair;
    for _ in 0..DEPTH_SLIDE_STEPS {
        let along = (free - t).normalize_or_zero();
        match scene.classify(Candidates::All, t) {
            Place::Free => return t,
            Place::Unclear => return free,
            Place::Blocked(k) => {
                let Some(exit) = scene.obstacle(k).exit(t, along) else { return free };
                spaces.push(HalfSpace { normal: exit.normal, offset: exit.offset + scene.hair });
            }
        }
        match nearest_common(&spaces, slack) {
            Some(next) if next.length_squared() < free.length_squared() => t = next,
            _ => return free,
        }
    }
    free
}
