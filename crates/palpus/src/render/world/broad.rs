//! Which bodies may be near each other: boxes along the axes of the world, sorted along x and swept.
//!
//! The order of the last tick is nearly right in this one, so that sorting by insertion is linear.

use glam::DVec3;

use crate::algebra::Pose;
use crate::body::Aabb;

/// See the module's description.
#[derive(Clone, Debug, Default)]
pub(super) struct Broad {
    boxes: Vec<Aabb>,
    there: Vec<bool>,
    /// Bodies by the low end of their boxes.
    order: Vec<u32>,
}

impl Broad {
    /// Room for one body more.
    pub(super) fn add(&mut self) {
        self.order.push(self.boxes.len() as u32);
        self.boxes.push(Aabb { min: DVec3::ZERO, max: DVec3::ZERO });
        self.there.push(false);
    }

    /// Body `i`, whose mesh lies within `bounds` in its own frame, is at `pose`; what is within `margin` (m) of it is near.
    pub(super) fn put(&mut self, i: usize, bounds: &Aabb, pose: &Pose, margin: f64) {
        let placement = pose.placement();
        let center = placement.point(0.5 * (bounds.min + bounds.max));
        let half = 0.5 * (bounds.max - bounds.min);
        let rotation = placement.rotation;
        let extent = rotation.x_axis.abs() * half.x + rotation.y_axis.abs() * half.y + rotation.z_axis.abs() * half.z;
        let extent = extent + DVec3::splat(margin);
        self.boxes[i] = Aabb { min: center - extent, max: center + extent };
        self.there[i] = true;
    }

    /// Body `i` is not there.
    pub(super) fn take_away(&mut self, i: usize) {
        self.there[i] = false;
    }

    /// Calls `found` for each two bodies that are near each other, in no order that means anything.
    pub(super) fn each_pair(&mut self, mut found: impl FnMut(usize, usize)) {
        let boxes = &self.boxes;
        for k in 1..self.order.len() {
            let mut at = k;
            while at > 0 && boxes[self.order[at] as usize].min.x < boxes[self.order[at - 1] as usize].min.x {
                self.order.swap(at, at - 1);
                at -= 1;
            }
        }
        for (k, &i) in self.order.iter().enumerate() {
            let i = i as usize;
            if !self.there[i] {
                continue;
            }
            let own = &boxes[i];
            let near = self.order[k + 1..].iter().take_while(|&&j| boxes[j as usize].min.x <= own.max.x);
            for &j in near {
                let other = &boxes[j as usize];
                let apart = other.min.y > own.max.y
                    || own.min.y > other.max.y
                    || other.min.z > own.max.z
                    || own.min.z > other.max.z;
                if self.there[j as usize] && !apart {
                    found(i, j as usize);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::random::Random;

    const SEED: u64 = 0xb40a_0001;

    #[test]
    fn it_finds_what_looking_at_all_pairs_finds() {
        let mut random = Random(SEED);
        let mut broad = Broad::default();
        let count = 40;
        (0..count).for_each(|_| broad.add());
        let bounds = Aabb { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) };
        for round in 0..20 {
            for i in 0..count {
                if random.unit() < 0.1 {
                    broad.take_away(i);
                } else {
                    broad.put(i, &bounds, &Pose::from_translation(random.vector() * 3.0), 0.1);
                }
            }
            let mut found = Vec::new();
            broad.each_pair(|i, j| found.push((i.min(j), i.max(j))));
            found.sort_unstable();
            let overlap = |i: usize, j: usize| {
                let (one, other) = (&broad.boxes[i], &broad.boxes[j]);
                one.min.cmple(other.max).all() && other.min.cmple(one.max).all()
            };
            let expected: Vec<_> = (0..count)
                .flat_map(|i| (i + 1..count).map(move |j| (i, j)))
                .filter(|&(i, j)| broad.there[i] && broad.there[j] && overlap(i, j))
                .collect();
            assert_eq!(found, expected, "round {round}, seed {SEED:#x}");
        }
    }
}
