//! Starts of a walk \[K02 §3.3.2\].
//!
//! 1. Each seed gives a direction and a vertex of each body from which to climb to the supports
//!    along it.
//! 2. The supports make a hub pair, which is valid by construction, and the offset h of the
//!    direction, which is an upper bound of the depth already.

use glam::DVec3;

use super::cso::Cso;
use super::{Antipodal, Depth, HubPair};

/// A guess of the direction of least depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seed {
    /// The pair's last answer, from the walk or the distance search: its normal in b's frame (b
    /// into a, need not be unit), vertices of its features, and its facet if the walk gave it.
    Previous {
        /// The facet of the CSO on which the walk ended; none if the distance search answered.
        antipodal: Option<Antipodal>,
        /// Vertices to climb from.
        hub: HubPair,
        /// From b into a, in b's frame.
        normal: DVec3,
    },
    /// The direction in which a distance search noticed the overlap: from b into a, in b's frame,
    /// need not be unit.
    Witness {
        /// From b into a, in b's frame.
        direction: DVec3,
    },
    /// The line from the centroid of b to that of a.
    CentroidLine,
}

impl Depth {
    /// The seed for the next pose, which is near.
    pub fn seed(&self) -> Seed {
        Seed::Previous { antipodal: Some(self.antipodal), hub: self.hub, normal: self.normal }
    }
}

/// A hub pair that supports a direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub(super) hub: HubPair,
    /// Unit.
    pub(super) normal: DVec3,
    /// h along the normal.
    pub(super) offset: f64,
}

impl Start {
    /// The start along `direction`; none if that has no direction.
    pub(super) fn along(cso: &Cso<'_>, direction: DVec3, hint: HubPair) -> Option<Self> {
        let normal = direction.try_normalize()?;
        let (hub, offset) = cso.support(hint, normal);
        Some(Self { hub, normal, offset })
    }

    /// As [`Self::along`], without a hint.
    pub(super) fn anew(cso: &Cso<'_>, direction: DVec3) -> Option<Self> {
        let normal = direction.try_normalize()?;
        let (hub, offset) = cso.support_anew(normal);
        Some(Self { hub, normal, offset })
    }

    /// The start that a seed gives.
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
