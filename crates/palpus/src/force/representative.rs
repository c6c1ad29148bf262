//! One contact for each cluster \[K02 §4.2, eq. 3–5\].
//!
//! The weight of a contact is t − d, where t is the tolerance of the query. So deeper contacts
//! count more. The weights of a patch's corners are multiplied by their tilt shares, so all corners
//! together count as one contact. If the normals cancel, eq. 3 has no solution. Then the
//! direction of the deepest member is used, and a flag reports it. Clusters cut by normals
//! ([`super::LinkageSettings::split_angle`]) cannot cancel.

use glam::DVec3;

use crate::algebra::tolerance::{CANCELLED_NORMAL, MIDPOINT_ROUNDING, SANE_WEIGHTS};
use crate::detect::Contact;

/// The representative contact of a cluster, in b's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Cluster {
    /// p̂ (eq. 4).
    pub midpoint: DVec3,
    /// n (eq. 3): unit, from b into a.
    pub normal: DVec3,
    /// d (eq. 5): the separation of the deepest member, m.
    pub separation: f64,
    /// t − d, m; 0 if negative. Contacts push below the separation t: the tolerance, or the contact
    /// offset of a coupling.
    pub engagement: f64,
    /// Sum of the members' weights, m.
    pub weight: f64,
    /// Index of the deepest member among the contacts.
    pub deepest: u32,
    /// Index of the cluster's first member in the list of all members.
    pub first_member: u32,
    /// Number of members.
    pub member_count: u32,
    /// True if eq. 3 had no solution; then `normal` is the deepest member's normal.
    pub cancelled: bool,
}

impl Cluster {
    /// Returns the range of the cluster's members in the list of all members.
    pub fn members(&self) -> std::ops::Range<usize> {
        self.first_member as usize..(self.first_member + self.member_count) as usize
    }
}

/// A broken rule of a representative.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
enum ClusterFault {
    /// The length of the normal is not 1.
    #[error("the normal is not unit")]
    Normal,
    /// A member is deeper than the cluster, or the deepest member's separation differs from the
    /// cluster's separation.
    #[error("the separation differs from the deepest member's")]
    Separation,
    /// The midpoint is outside the bounding box of the members' midpoints.
    #[error("the midpoint is outside the box of the members' midpoints")]
    Midpoint,
}

impl Cluster {
    /// Returns the first broken rule. The normal has the length 1 (eq. 3), the midpoint lies in the
    /// box of the members' midpoints (eq. 4), and the separation is that of the deepest member
    /// (eq. 5).
    fn validate(&self, contacts: &[Contact], members: &[u32]) -> Result<(), ClusterFault> {
        let of_members = || members.iter().map(|&i| &contacts[i as usize]);
        let (low, high) = of_members().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), contact| {
            (low.min(contact.midpoint()), high.max(contact.midpoint()))
        });
        let rounding = DVec3::splat(MIDPOINT_ROUNDING * low.abs().max(high.abs()).max_element());
        let deepest = of_members().map(|contact| contact.separation).fold(f64::INFINITY, f64::min);
        let named = contacts[self.deepest as usize].separation;
        if (self.normal.length() - 1.0).abs() > MIDPOINT_ROUNDING {
            Err(ClusterFault::Normal)
        } else if deepest != self.separation || named != self.separation {
            Err(ClusterFault::Separation)
        } else if !(self.midpoint.cmpge(low - rounding) & self.midpoint.cmple(high + rounding)).all() {
            Err(ClusterFault::Midpoint)
        } else {
            Ok(())
        }
    }
}

/// Returns the representative of the contacts with the indices `members` (at least one). The force
/// `directions` and the positive `weights` (m) are parallel to `members`. Contacts push below a
/// separation of `offset` (m).
///
/// The sums run in the order of `members`. `first_member` is stored unchanged.
pub fn represent(
    contacts: &[Contact],
    members: &[u32],
    directions: &[DVec3],
    weights: &[f64],
    first_member: u32,
    offset: f64,
) -> Cluster {
    debug_assert!(!members.is_empty() && members.len() == directions.len());
    let separation = |k: usize| contacts[members[k] as usize].separation;
    // Midpoints are summed relative to the first midpoint, so a small cluster far from the origin
    // keeps its precision.
    let origin = contacts[members[0] as usize].midpoint();
    let mut weight = 0.0;
    let mut weighted_normal = DVec3::ZERO;
    let mut weighted_midpoint = DVec3::ZERO;
    let mut deepest = 0;
    for (k, (&i, &direction)) in members.iter().zip(directions).enumerate() {
        let w = weights[k];
        weight += w;
        weighted_normal += w * direction;
        weighted_midpoint += w * (contacts[i as usize].midpoint() - origin);
        if separation(k) < separation(deepest) {
            deepest = k;
        }
    }
    let length = weighted_normal.length();
    let cancelled = length <= CANCELLED_NORMAL * weight;
    let normal = if cancelled { directions[deepest] } else { weighted_normal / length }; // Eq. 3
    let midpoint = origin + weighted_midpoint / weight; // Eq. 4
    let engagement = (offset - separation(deepest)).max(0.0);
    let cluster = Cluster {
        midpoint,
        normal,
        separation: separation(deepest), // Eq. 5
        engagement,
        weight,
        deepest: members[deepest],
        first_member,
        member_count: members.len() as u32,
        cancelled,
    };
    // With absurd tolerances, products with the weights overflow or lose precision. So nothing is
    // checked outside this range.
    let [least, most] = SANE_WEIGHTS;
    let is_sane = (least..most).contains(&weight);
    debug_assert!(
        !is_sane || cluster.validate(contacts, members) == Ok(()),
        "{:?}",
        cluster.validate(contacts, members)
    );
    cluster
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Random, contact};
    use super::*;

    const SEED: u64 = 0x3E92;
    const T: f64 = 1e-3;

    fn of(contacts: &[Contact]) -> Cluster {
        let members: Vec<u32> = (0..contacts.len() as u32).collect();
        let directions: Vec<DVec3> = contacts.iter().map(|contact| contact.normal).collect();
        let weights: Vec<f64> = contacts.iter().map(|contact| T - contact.separation).collect();
        represent(contacts, &members, &directions, &weights, 0, T)
    }

    #[test]
    fn single_contact_represents_itself() {
        let n = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let only = contact((4, 5), DVec3::new(0.1, -0.2, 0.3), n, -2e-4);
        let cluster = of(&[only]);
        assert!((cluster.midpoint - only.midpoint()).length() < 1e-16);
        assert!((cluster.normal - n).length() < 1e-15);
        assert_eq!(cluster.separation, -2e-4);
        assert!((cluster.engagement - 1.2e-3).abs() < 1e-18);
        assert!(!cluster.cancelled);
    }

    #[test]
    fn wrong_representatives_are_named() {
        let contacts =
            [contact((0, 0), DVec3::ZERO, DVec3::Z, -1e-4), contact((1, 0), DVec3::X * 1e-3, DVec3::X, 2e-4)];
        let cluster = of(&contacts);
        let fault = |cluster: Cluster| cluster.validate(&contacts, &[0, 1]);
        assert_eq!(fault(cluster), Ok(()));
        assert_eq!(fault(Cluster { normal: cluster.normal * 1.001, ..cluster }), Err(ClusterFault::Normal));
        assert_eq!(fault(Cluster { separation: 2e-4, ..cluster }), Err(ClusterFault::Separation));
        assert_eq!(fault(Cluster { deepest: 1, ..cluster }), Err(ClusterFault::Separation));
        assert_eq!(fault(Cluster { midpoint: DVec3::X * 1.1e-3, ..cluster }), Err(ClusterFault::Midpoint));
    }

    #[test]
    fn copies_change_nothing_and_deepest_sets_the_depth() {
        let mut random = Random::new(SEED);
        let contacts: Vec<_> = (0..9)
            .map(|k| {
                let n = (DVec3::Z + random.point(0.4)).normalize();
                contact((k, 0), random.point(2e-3), n, random.between(-1e-3, 0.9e-3))
            })
            .collect();
        let once = of(&contacts);
        let twice = of(&[contacts.clone(), contacts.clone()].concat());
        assert!((once.normal - twice.normal).length() < 1e-14, "seed {SEED:#x}");
        assert!((once.midpoint - twice.midpoint).length() < 1e-16, "seed {SEED:#x}");
        assert_eq!(once.separation, twice.separation);
        let deepest = contacts.iter().map(|c| c.separation).fold(1.0, f64::min);
        assert_eq!(once.separation, deepest);
        assert_eq!(contacts[once.deepest as usize].separation, deepest);
    }

    #[test]
    fn weights_are_engagements() {
        // The engagements have the ratio 3 : 1.
        let contacts =
            [contact((0, 0), DVec3::ZERO, DVec3::X, T - 3e-4), contact((1, 0), DVec3::X * 4e-3, DVec3::Y, T - 1e-4)];
        let cluster = of(&contacts);
        assert!((cluster.midpoint - DVec3::X * 1e-3).length() < 1e-16);
        assert!((cluster.normal - DVec3::new(3.0, 1.0, 0.0).normalize()).length() < 1e-12);
        assert!((cluster.weight - 4e-4).abs() < 1e-18);
        // A contact at the tolerance has no weight.
        let entering = contact((2, 0), DVec3::splat(1.0), -DVec3::Z, T * (1.0 - 1e-15));
        let more = of(&[contacts[0], contacts[1], entering]);
        assert!((more.midpoint - cluster.midpoint).length() < 1e-11);
        assert!((more.normal - cluster.normal).length() < 1e-11);
    }

    #[test]
    fn cancelled_normals_use_the_deepest_contact() {
        let contacts =
            [contact((0, 0), DVec3::ZERO, DVec3::X, -1e-4), contact((1, 0), DVec3::Y * 1e-3, -DVec3::X, -1e-4)];
        let cluster = of(&contacts);
        assert!(cluster.cancelled);
        assert_eq!(cluster.normal, DVec3::X);
        assert!((cluster.midpoint - DVec3::Y * 0.5e-3).length() < 1e-16);
    }
}
