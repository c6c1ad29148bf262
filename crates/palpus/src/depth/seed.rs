//! Starts of a depth walk \[K02 §3.3.2\].
//!
//! 1. Each seed gives a direction, and one vertex of each body. The search for the supports along
//!    the direction climbs from these vertices.
//! 2. The two supports always form a valid hub pair. The offset h of the direction is an upper
//!    bound of the depth.

use glam::DVec3;

use super::cso::Cso;
use super::{Antipodal, Depth, HubPair};

/// A guess of the direction with the smallest depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seed {
    /// The pair's previous answer, from the walk or from the distance search. The seed has the
    /// answer's normal, the vertices of its features, and its facet if the walk gave the answer.
    Previous {
        /// The facet of the CSO on which the walk ended. `None` if the distance search gave the
        /// answer.
        antipodal: Option<Antipodal>,
        /// Vertices from which the search for the supports climbs.
        hub: HubPair,
        /// From body b into body a, in b's frame; need not have unit length.
        normal: DVec3,
    },
    /// The direction in which a distance search detected the overlap.
    Witness {
        /// From body b into body a, in b's frame; need not have unit length.
        direction: DVec3,
    },
    /// The line from the centroid of b to the centroid of body a.
    CentroidLine,
}

impl Depth {
    /// Returns the seed for a query at a nearby pose, such as the next tick's.
    pub fn seed(&self) -> Seed {
        Seed::Previous { antipodal: Some(self.antipodal), hub: self.hub, normal: self.normal }
    }
}

/// A direction and a hub pair that supports it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub(super) hub: HubPair,
    /// Unit vector.
    pub(super) normal: DVec3,
    /// Depth h along the normal (length unit of the polytopes).
    pub(super) offset: f64,
}

impl Start {
    /// Returns the start along `direction`; its supports climb from `hint`. `None` if `direction`
    /// is zero or not finite.
    pub(super) fn along(cso: &Cso<'_>, direction: DVec3, hint: HubPair) -> Option<Self> {
        let normal = direction.try_normalize()?;
        let (hub, offset) = cso.support(hint, normal);
        Some(Self { hub, normal, offset })
    }

    /// Returns the same as [`Self::along`], without a hint.
    pub(super) fn anew(cso: &Cso<'_>, direction: DVec3) -> Option<Self> {
        let normal = direction.try_normalize()?;
        let (hub, offset) = cso.support_anew(normal);
        Some(Self { hub, normal, offset })
    }

    /// Returns the start of a seed. `hint` is used if the seed's vertices are out of range.
    pub(super) fn of(cso: &Cso<'_>, seed: &Seed, hint: HubPair) -> Option<Self> {
        match *seed {
            Seed::Previous { hub, normal, .. } => {
                let known = (hub.a as usize) < cso.a.vertices().len() && (hub.b as usize) < cso.b.vertices().len();
                Self::along(cso, normal, if known { hub } else { hint })
            }
            Seed::Witness { direction } => Self::anew(cso, direction),
            Seed::CentroidLine => Self::anew(cso, cso.pose_ba.point(cso.a.centroid()) - cso.b.centroid()),
        }
    }
}
