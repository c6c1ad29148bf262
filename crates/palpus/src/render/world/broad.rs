//! Finds the bodies that may be near each other, by sweep and prune: axis-aligned boxes are sorted
//! along x.
//!
//! The order changes little from tick to tick, so insertion sort takes nearly linear time. Each box
//! has a margin. A box is computed again only when its body leaves the margin, and pairs are
//! searched again only when a box has changed.

use glam::DVec3;

use crate::algebra::Pose;
use crate::body::Aabb;

/// See the module's description.
#[derive(Clone, Debug, Default)]
pub(super) struct Broad {
    boxes: Vec<Aabb>,
    /// Pose of each body when its box was computed, and the box's margin, m.
    made: Vec<(Pose, f64)>,
    /// True if a box has changed since the last search for pairs.
    is_stale: bool,
    there: Vec<bool>,
    /// Bodies in the order of the low ends of their boxes.
    order: Vec<u32>,
}

impl Broad {
    /// Allocates memory for another body.
    pub(super) fn add(&mut self) {
        self.order.push(self.boxes.len() as u32);
        self.boxes.push(Aabb { min: DVec3::ZERO, max: DVec3::ZERO });
        self.made.push((Pose::IDENTITY, 0.0));
        self.there.push(false);
    }

    /// Returns true if the box of body `i` at `pose` still contains everything within `margin`
    /// (m) of the body. No point of its mesh is farther than `radius` (m) from its frame's origin.
    pub(super) fn holds(&self, i: usize, pose: &Pose, radius: f64, margin: f64) -> bool {
        let (made_at, made_with) = &self.made[i];
        // A rotation by θ moves a point at radius r by 2 r sin(θ/2), which is at most 4 r sin(θ/4).
        // The distance of the unit quaternions is 2 sin(θ/4).
        let turned = 2.0 * (pose.rotation - made_at.rotation).length() * radius;
        self.there[i] && (pose.translation - made_at.translation).length() + turned + margin <= *made_with
    }

    /// Returns true if a box has changed since the last call.
    pub(super) fn take_stale(&mut self) -> bool {
        std::mem::replace(&mut self.is_stale, false)
    }

    /// Sets the box of body `i` at `pose`: the body's `bounds` (in its frame) plus `margin` (m).
    pub(super) fn put(&mut self, i: usize, bounds: &Aabb, pose: &Pose, margin: f64) {
        let placement = pose.placement();
        let center = placement.point(0.5 * (bounds.min + bounds.max));
        let half = 0.5 * (bounds.max - bounds.min);
        let rotation = placement.rotation;
        let extent = rotation.x_axis.abs() * half.x + rotation.y_axis.abs() * half.y + rotation.z_axis.abs() * half.z;
        let extent = extent + DVec3::splat(margin);
        self.boxes[i] = Aabb { min: center - extent, max: center + extent };
        self.made[i] = (*pose, margin);
        self.there[i] = true;
        self.is_stale = true;
    }

    /// Removes body `i`.
    pub(super) fn take_away(&mut self, i: usize) {
        self.is_stale |= std::mem::replace(&mut self.there[i], false);
    }

    /// Calls `found` for each two bodies that are near each other, in unspecified order.
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
    use glam::DQuat;

    use super::*;
    use crate::algebra::Random;

    const SEED: u64 = 0xb40a_0001;

    #[test]
    fn kept_box_contains_everything_within_the_margin() {
        const MARGIN: f64 = 0.1;
        let mut random = Random::new(SEED);
        let mut broad = Broad::default();
        broad.add();
        let bounds = Aabb { min: DVec3::new(-0.5, -0.2, 0.0), max: DVec3::new(0.5, 0.3, 0.1) };
        let corner = |k: u32| {
            DVec3::select(
                DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64).cmpgt(DVec3::splat(0.5)),
                bounds.max,
                bounds.min,
            )
        };
        let mut kept = 0;
        for _ in 0..2000 {
            let from = Pose::new(DQuat::from_scaled_axis(random.vector() * 2.0), random.vector());
            broad.put(0, &bounds, &from, MARGIN + 0.05);
            let turn = DQuat::from_scaled_axis(random.vector() * 0.1 * random.unit());
            let pose = Pose::new(turn * from.rotation, from.translation + random.vector() * 0.05 * random.unit());
            if !broad.holds(0, &pose, 0.6, MARGIN) {
                continue;
            }
            kept += 1;
            let own = &broad.boxes[0];
            for point in (0..8).map(|k| pose.point(corner(k))) {
                let inside = (own.min + MARGIN).cmple(point).all() && point.cmple(own.max - MARGIN).all();
                assert!(inside, "{point} at {pose:?}, seed {SEED:#x}");
            }
        }
        assert!((200..1800).contains(&kept), "{kept}");
    }

    #[test]
    fn pairs_equal_an_exhaustive_search() {
        let mut random = Random::new(SEED);
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
