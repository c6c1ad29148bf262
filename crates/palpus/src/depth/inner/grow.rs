//! Grows the inner surface to a new corner. Opens a hole at the triangles that face the corner, and
//! closes the hole with a fan around the corner.

use glam::DVec3;

use super::super::HubPair;
use super::super::cso::Cso;
use super::{Half, Joint, Refusal, Rim, Surface, Tip, judged, judged_from};
use crate::algebra::tolerance::{PROOF_CORNERS, PROOF_HOLE, PROOF_TRIANGLES};

impl Surface {
    /// Grows the surface from `triangle` to the tip of `hub`, which should lie above the triangle.
    pub(in crate::depth) fn grow(&mut self, cso: &Cso<'_>, triangle: usize, hub: HubPair) -> Result<(), Refusal> {
        let at = cso.vertex(hub);
        let known = if self.folded { self.known(at) } else { None };
        self.open(triangle, at, known)?;
        if self.joints.len() + self.rim.len() > PROOF_TRIANGLES + self.free.len() {
            return Err(Refusal::Full);
        }
        if let Some(tip) = known {
            self.order_rim()?;
            self.fan(tip);
            return Ok(());
        }
        if self.tips.len() == PROOF_CORNERS {
            return Err(Refusal::Full);
        }
        let tip = self.tips.len() as u16;
        self.tips.push(Tip { hub, at });
        if self.is_ring() {
            self.fan_ring(tip);
        } else {
            self.order_rim()?;
            self.fan(tip);
        }
        Ok(())
    }

    /// Returns the existing tip at the point `at`.
    #[cold]
    fn known(&self, at: DVec3) -> Option<u16> {
        let near = self.slack * self.slack;
        self.tips.iter().position(|tip| tip.at.distance_squared(at) <= near).map(|tip| tip as u16)
    }

    /// Removes the triangles around `seed` that face the point `at` or have the tip `known`. Lists
    /// the rim of the hole.
    ///
    /// The search visits the edges of each triangle counter-clockwise, starting from the edge
    /// through which it reached the triangle. So the rim is in order if the hole is a disk.
    fn open(&mut self, seed: usize, at: DVec3, known: Option<u16>) -> Result<(), Refusal> {
        const ONWARD: [[usize; 2]; 4] = [[1, 2], [2, 0], [0, 1], [0, 1]];
        let Self { joints, normals, offsets, free, ahead, rim, .. } = self;
        // On a convex surface, the new tip may lie in the plane of a neighbour, beyond the edge to
        // this neighbour. Then the neighbour must be removed too; otherwise the fan would fold
        // under it. On a surface that moved with the bodies, a triangle in this plane may already
        // have the tip. The triangle is then removed because it has the tip.
        let least = if self.folded { self.slack } else { -self.slack };
        rim.clear();
        ahead.clear();
        joints[seed].alive = false;
        offsets[seed] = f64::INFINITY;
        free.push(seed as u16);
        let [mut half, two, three] = joints[seed].across;
        ahead.push(three);
        ahead.push(two);
        let mut room = PROOF_HOLE;
        loop {
            let place = half.triangle();
            let outer = &mut joints[place];
            if outer.alive {
                if room == 0 {
                    return Err(Refusal::Full);
                }
                room -= 1;
                let [next, last] = ONWARD[half.side()];
                let offset = offsets[place];
                let gives_way = normals[place].dot(at) - offset > least
                    || offset.is_infinite()
                    || known.is_some_and(|tip| outer.tips.contains(&tip));
                if gives_way {
                    outer.alive = false;
                    offsets[place] = f64::INFINITY;
                    free.push(place as u16);
                    ahead.push(outer.across[last]);
                    half = outer.across[next];
                    continue;
                }
                rim.push(Rim { from: outer.tips[next], to: outer.tips[half.side()], outer: half });
            }
            match ahead.pop() {
                Some(next) => half = next,
                None => return Ok(()),
            }
        }
    }

    /// Returns true if the rim runs around the hole once, in order.
    #[inline]
    fn is_ring(&self) -> bool {
        let Some(last) = self.rim.last() else { return false };
        let mut end = last.to;
        self.rim.iter().all(|edge| {
            let follows = edge.from == end;
            end = edge.to;
            follows
        })
    }

    /// Closes a hole whose rim is a ring, with a fan around a new tip.
    fn fan_ring(&mut self, tip: u16) {
        let Self { tips, joints, normals, offsets, free, rim, .. } = self;
        // Takes as many free places as the rim has edges, from the end of the list.
        while free.len() < rim.len() {
            free.push(joints.len() as u16);
            let across = [Half::new(0, 0); 3];
            joints.push(Joint { tips: [0; 3], across, alive: false });
            normals.push(DVec3::ZERO);
            offsets.push(f64::INFINITY);
        }
        let rest = free.len() - rim.len();
        let places = &free[rest..];
        let (Some(&first), Some(&last), Some(edge)) = (places.first(), places.last(), rim.first()) else { return };
        let at = tips[usize::from(tip)].at;
        let mut before = last;
        let mut p = tips[usize::from(edge.from)].at;
        let (mut u, least_height) = (p - at, self.slack * self.slack);
        for (k, (&Rim { from, to, outer }, &here)) in rim.iter().zip(places).enumerate() {
            let after = places.get(k + 1).copied().unwrap_or(first);
            let q = tips[usize::from(to)].at;
            let v = q - at;
            let place = usize::from(here);
            joints[outer.triangle()].across[outer.side()] = Half::new(here, 0);
            let across = [outer, Half::new(after, 2), Half::new(before, 1)];
            joints[place] = Joint { tips: [from, to, tip], across, alive: true };
            (normals[place], offsets[place]) = judged_from(at, [p, q], [u, v], least_height);
            (p, u, before) = (q, v, here);
        }
        free.truncate(rest);
    }

    /// Sorts the edges of the rim so that each edge starts where the previous edge ends. The edges
    /// form one loop or several loops.
    fn order_rim(&mut self) -> Result<(), Refusal> {
        let mut begin = 0;
        for k in 0..self.rim.len() {
            let end = self.rim[k].to;
            match (k + 1..self.rim.len()).find(|&j| self.rim[j].from == end) {
                Some(j) => self.rim.swap(k + 1, j),
                None if end == self.rim[begin].from => begin = k + 1,
                None => return Err(Refusal::Torn),
            }
        }
        if self.rim.is_empty() { Err(Refusal::Torn) } else { Ok(()) }
    }

    /// Closes the hole with triangles from the edges of the rim to the tip.
    fn fan(&mut self, tip: u16) {
        let mut k = 0;
        while k < self.rim.len() {
            k = self.fan_loop(tip, k);
        }
    }

    /// Closes one loop of the rim, which starts at `begin`. Returns the start of the next loop.
    fn fan_loop(&mut self, tip: u16, begin: usize) -> usize {
        let home = self.rim[begin].from;
        let mut first: Option<Half> = None;
        let mut leaving: Option<Half> = None;
        let mut k = begin;
        loop {
            let Rim { from, to, outer } = self.rim[k];
            // The edges tip → from and to → tip. These edges belong to the new triangle. If the rim
            // itself contains the tip, they belong to the outer triangle.
            let (entry, exit) = if to == tip {
                (Some(outer), None)
            } else if from == tip {
                (None, Some(outer))
            } else {
                let new = self.place([from, to, tip], outer);
                (Some(Half::new(new, 2)), Some(Half::new(new, 1)))
            };
            if k == begin {
                first = entry;
            } else {
                self.join(leaving, entry);
            }
            leaving = exit;
            k += 1;
            // A loop may pass its first tip several times. The loop ends when the next edge does
            // not start at its first tip.
            if to == home && self.rim.get(k).is_none_or(|next| next.from != to) {
                break;
            }
            if k == self.rim.len() {
                break;
            }
        }
        self.join(leaving, first);
        k
    }

    /// Puts a triangle at a free place or at the end of the list, and joins its first edge to
    /// `outer`. The caller joins the other two edges.
    fn place(&mut self, tips: [u16; 3], outer: Half) -> u16 {
        let joint = Joint { tips, across: [outer; 3], alive: true };
        let place = match self.free.pop() {
            Some(place) => {
                let k = usize::from(place);
                (self.normals[k], self.offsets[k]) = judged(tips.map(|tip| self.tips[usize::from(tip)].at), self.slack);
                self.joints[k] = joint;
                place
            }
            None => {
                self.push_triangle(joint);
                self.joints.len() as u16 - 1
            }
        };
        self.joints[outer.triangle()].across[outer.side()] = Half::new(place, 0);
        place
    }

    #[inline]
    fn join(&mut self, one: Option<Half>, other: Option<Half>) {
        if let (Some(one), Some(other)) = (one, other) {
            self.joints[one.triangle()].across[one.side()] = other;
            self.joints[other.triangle()].across[other.side()] = one;
        }
    }
}
