//! Step 4 of the clustering: cuts groups whose normals do not fit into one cone.

use glam::DVec3;

use super::Linkage;
use crate::algebra::tolerance::CAP_STEPS;
use crate::detect::Contact;

impl Linkage {
    /// Step 4: labels each member of each group with its cone. Returns the number of groups that
    /// were cut.
    pub(super) fn cut(&mut self, contacts: &[Contact], cos_half: f64) -> u32 {
        let mut cut_groups = 0;
        for group in 0..self.len() {
            let (start, end) = (self.starts[group] as usize, self.starts[group + 1] as usize);
            let label = self.ranks[start];
            for k in start..end {
                self.labels[self.ranks[k] as usize] = label;
            }
            if !fits_a_cone(&self.ranks[start..end], &self.normals, cos_half) {
                self.cut_group(start, end, contacts, cos_half);
                cut_groups += 1;
            }
        }
        cut_groups
    }

    fn cut_group(&mut self, start: usize, end: usize, contacts: &[Contact], cos_half: f64) {
        let group = &self.ranks[start..end];
        let depth = |rank: u32| -contacts[self.order[rank as usize] as usize].separation;
        let mut leader = group[0];
        for &rank in group {
            self.labels[rank as usize] = u32::MAX;
            self.to_leader[rank as usize] = -1.0;
            if depth(rank) > depth(leader) {
                leader = rank;
            }
        }
        loop {
            let axis = self.normals[leader as usize];
            let mut next: Option<u32> = None;
            for &rank in group {
                if self.labels[rank as usize] != u32::MAX {
                    continue;
                }
                let cosine = self.normals[rank as usize].dot(axis);
                let nearest = self.to_leader[rank as usize].max(cosine);
                self.to_leader[rank as usize] = nearest;
                if cosine >= cos_half || rank == leader {
                    self.labels[rank as usize] = leader;
                } else if next.is_none_or(|other| nearest < self.to_leader[other as usize]) {
                    next = Some(rank);
                }
            }
            match next {
                Some(rank) => leader = rank,
                None => return,
            }
        }
    }
}

/// Returns true if the normals fit into a cone of the given half opening.
///
/// The search moves the cone's axis from the mean normal toward the farthest normal in ever shorter
/// steps (Bădoiu and Clarkson's smallest enclosing ball, on the sphere). So the result depends on
/// the set of normals, not on the number of contacts with the same normal. If two normals differ by
/// more than the whole opening, the search ends at once.
pub(super) fn fits_a_cone(ranks: &[u32], normals: &[DVec3], cos_half: f64) -> bool {
    let normal = |&rank: &u32| normals[rank as usize];
    let Some(first) = ranks.first().map(normal) else { return true };
    let mut axis = ranks.iter().map(normal).sum::<DVec3>().try_normalize().unwrap_or(first);
    let mut before = first;
    for step in 0..CAP_STEPS {
        let (mut farthest, mut least) = (axis, axis.dot(axis));
        for n in ranks.iter().map(normal) {
            let cosine = n.dot(axis);
            if cosine < least {
                (farthest, least) = (n, cosine);
            }
        }
        if least >= cos_half {
            return true;
        }
        if farthest.dot(before) < 2.0 * cos_half * cos_half - 1.0 {
            return false;
        }
        before = farthest;
        axis = (axis + (farthest - axis) / f64::from(step + 2)).try_normalize().unwrap_or(first);
    }
    false
}
