//! Validation of the clusters' invariants.
//!
//! 1. Partition: each admitted contact is in exactly one cluster. No cluster is empty. The
//!    members of a cluster are in canonical order, and clusters are ordered by their first members.
//! 2. Eq. 2: two contacts with equal labels and nearer than the radius are in one cluster. The
//!    check is quadratic, so it runs only if there are few contacts.
//! 3. Cones: all members of a cluster have the same label. If a split angle is set, their normals
//!    fit into one cone.

use super::cut::fits_a_cone;
use super::{Linkage, LinkageSettings};
use crate::algebra::tolerance::VALIDATED_CONTACTS;

/// A broken invariant of clusters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum ClusterFault {
    /// The ranges of the clusters do not cover all admitted contacts without gaps, or a range is
    /// empty.
    #[error("the clusters do not cover all {0} contacts without gaps")]
    Ranges(usize),
    /// The members of a cluster are not in canonical order, or a member belongs to another cluster.
    #[error("cluster {0} has members out of order, or members of another cluster")]
    Members(usize),
    /// Contacts nearer than the radius are in different clusters.
    #[error("contacts of ranks {0} and {1} are nearer than the radius and in different clusters")]
    Apart(u32, u32),
    /// A cluster has contacts of two cones, or normals that fit into no cone.
    #[error("the normals of cluster {0} do not fit into one cone")]
    Cone(usize),
}

impl Linkage {
    /// Checks the clusters of the last run and returns the first broken invariant.
    pub(super) fn validate(&self, settings: &LinkageSettings) -> Result<(), ClusterFault> {
        let count = self.order.len();
        let ascend = self.starts.windows(2).all(|range| range[0] < range[1]);
        let cover = self.starts.first() == Some(&0) && self.starts.last().is_some_and(|&end| end as usize == count);
        if !(ascend && cover) || [self.ranks.len(), self.members.len(), self.directions.len()] != [count; 3] {
            return Err(ClusterFault::Ranges(count));
        }
        (0..self.len()).try_for_each(|cluster| self.validate_cluster(cluster, settings))?;
        if count <= VALIDATED_CONTACTS && settings.radius > 0.0 {
            self.validate_linked(settings.radius)?;
        }
        Ok(())
    }

    /// Rules 1 and 3 for one cluster. Each rank was gathered for one cluster only, so no rank is in
    /// two clusters.
    fn validate_cluster(&self, cluster: usize, settings: &LinkageSettings) -> Result<(), ClusterFault> {
        let ranks = &self.ranks[self.range(cluster)];
        let ascend = ranks.windows(2).all(|pair| pair[0] < pair[1]);
        let own = |&rank: &u32| self.group_of.get(rank as usize) == Some(&(cluster as u32));
        let follows = cluster == 0 || self.ranks[self.range(cluster - 1).start] < ranks[0];
        let named = self.range(cluster).all(|k| self.members[k] == self.order[self.ranks[k] as usize]);
        if !(ascend && follows && named && ranks.iter().all(own)) {
            return Err(ClusterFault::Members(cluster));
        }
        let label = self.labels[ranks[0] as usize];
        if ranks.iter().any(|&rank| self.labels[rank as usize] != label) {
            return Err(ClusterFault::Cone(cluster));
        }
        let Some(angle) = settings.split_angle else { return Ok(()) };
        let cos_half = (0.5 * angle).cos();
        // The axis of a cone is the normal of its first contact. That contact may be in another
        // cluster now.
        let axis = self.normals[label as usize];
        let led = ranks.iter().all(|&rank| rank == label || self.normals[rank as usize].dot(axis) >= cos_half);
        if led || fits_a_cone(ranks, &self.normals, cos_half) { Ok(()) } else { Err(ClusterFault::Cone(cluster)) }
    }

    /// Checks rule 2.
    fn validate_linked(&self, radius: f64) -> Result<(), ClusterFault> {
        for (i, first) in self.points.iter().enumerate() {
            for (j, second) in self.points.iter().enumerate().skip(i + 1) {
                let near = first.distance_squared(*second) < radius * radius && self.labels[i] == self.labels[j];
                if near && self.group_of[i] != self.group_of[j] {
                    return Err(ClusterFault::Apart(i as u32, j as u32));
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::super::testing::{Random, contact};
    use super::*;
    use crate::detect::Contact;

    const SEED: u64 = 0xc105_fa17;
    const SETTINGS: LinkageSettings =
        LinkageSettings { tolerance: 1e-3, radius: 4e-3, split_angle: Some(2.0), most: 256, contact_offset: 1e-3 };

    fn contacts(random: &mut Random) -> Vec<Contact> {
        let one = |random: &mut Random, k: u32| {
            let middle = random.point(1e-2);
            contact((k, 0), middle, random.direction(), random.between(-1e-3, 9e-4))
        };
        (0..40).map(|k| one(random, k)).collect()
    }

    #[test]
    fn each_broken_invariant_is_named() {
        let mut random = Random::new(SEED);
        let mut linkage = Linkage::new(64);
        for case in 0..100 {
            let contacts = contacts(&mut random);
            linkage.run(&contacts, &SETTINGS, |contact| contact.separation, |contact| contact.normal);
            let what = format!("seed {SEED:#x}, case {case}");
            assert_eq!(linkage.validate(&SETTINGS), Ok(()), "{what}");
            let fault = |change: &dyn Fn(&mut Linkage)| {
                let mut broken = linkage.clone();
                change(&mut broken);
                broken.validate(&SETTINGS).expect_err("broken clusters")
            };
            let clusters = linkage.len();
            assert!(clusters > 1, "{what}");
            let cluster = random.below(clusters - 1) + 1;
            let empty = fault(&|linkage| linkage.starts[cluster] = linkage.starts[cluster - 1]);
            assert_eq!(empty, ClusterFault::Ranges(40), "{what}");
            let moved = fault(&|linkage| linkage.ranks.swap(0, linkage.starts[cluster] as usize));
            assert!(matches!(moved, ClusterFault::Members(_)), "{what}: {moved}");
            let renamed = fault(&|linkage| linkage.members[0] = (linkage.members[0] + 1) % 40);
            assert!(matches!(renamed, ClusterFault::Members(0)), "{what}: {renamed}");
            let near = fault(&|linkage| {
                let [one, other] = [0, linkage.starts[cluster]].map(|at| linkage.ranks[at as usize] as usize);
                linkage.points[one] = linkage.points[other];
                // Removes the cut.
                linkage.labels.fill(0);
                linkage.normals.fill(DVec3::Z);
            });
            assert!(matches!(near, ClusterFault::Apart(..)), "{what}: {near}");
            if let Some(large) = (0..clusters).find(|&k| linkage.range(k).len() > 1) {
                let [one, other] = [0, 1].map(|k| linkage.ranks[linkage.range(large).start + k] as usize);
                let cone = fault(&|linkage| {
                    linkage.normals[one] = DVec3::Z;
                    linkage.normals[other] = -DVec3::Z;
                });
                assert_eq!(cone, ClusterFault::Cone(large), "{what}");
                let labels = fault(&|linkage| linkage.labels[other] = u32::MAX);
                assert_eq!(labels, ClusterFault::Cone(large), "{what}");
            }
        }
    }
}
