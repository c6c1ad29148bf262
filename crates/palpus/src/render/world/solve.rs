//! The linear system of the bodies that one implicit step moves together. Its matrix consists of
//! 6×6 blocks: a diagonal block for each body, and two off-diagonal blocks for each pair of bodies
//! in contact.
//!
//! Gaussian elimination works block by block, and skips zero blocks. The pivots are the diagonal
//! blocks. If the matrix is symmetric, it is positive definite, and so is each pivot. Shaded forces
//! and sliding friction add terms that are not symmetric; a singular pivot is reported. Bodies with
//! few neighbours should come first, because the elimination of a body couples all of its remaining
//! neighbours (fill-in).

use crate::algebra::{SpatialInverse, SpatialMatrix, Twist, Wrench};

/// See the module's description.
#[derive(Clone, Debug)]
pub(super) struct BlockSystem {
    /// Row by row.
    blocks: Vec<SpatialMatrix>,
    /// True for each block that is not zero.
    filled: Vec<bool>,
    right: Vec<Wrench>,
    /// Inverses of the pivots.
    inverses: Vec<SpatialInverse>,
    twists: Vec<Twist>,
    /// Number of bodies.
    size: usize,
}

impl BlockSystem {
    /// Allocates memory for at most `most` bodies.
    pub(super) fn new(most: usize) -> Self {
        Self {
            blocks: vec![SpatialMatrix::ZERO; most * most],
            filled: vec![false; most * most],
            right: vec![Wrench::ZERO; most],
            inverses: Vec::with_capacity(most),
            twists: vec![Twist::default(); most],
            size: 0,
        }
    }

    /// Returns an empty system of `size` bodies.
    pub(super) fn begin(&mut self, size: usize) {
        self.size = size;
        self.inverses.clear();
        self.filled[..size * size].fill(false);
    }

    /// Sets the diagonal block and the right-hand side of body `i`.
    pub(super) fn set_own(&mut self, i: usize, block: SpatialMatrix, right: Wrench) {
        let at = self.place(i, i);
        (self.blocks[at], self.filled[at]) = (block, true);
        self.right[i] = right;
    }

    /// Subtracts `block` from the block in row `i` and column `j`.
    pub(super) fn take(&mut self, i: usize, j: usize, block: SpatialMatrix) {
        let at = self.place(i, j);
        if !std::mem::replace(&mut self.filled[at], true) {
            self.blocks[at] = SpatialMatrix::ZERO;
        }
        self.blocks[at] = self.blocks[at] - block;
    }

    /// Solves the system. Returns false if a pivot is singular.
    #[must_use]
    pub(super) fn solve(&mut self) -> bool {
        for k in 0..self.size {
            let Some(inverse) = self.blocks[self.place(k, k)].inverse() else { return false };
            // The solution without the bodies that are not eliminated yet.
            self.twists[k] = inverse.times(&self.right[k]);
            for i in k + 1..self.size {
                if !self.filled[self.place(i, k)] {
                    continue;
                }
                let below = self.blocks[self.place(i, k)];
                self.right[i] = self.right[i] + -below.times(&self.twists[k]);
                for j in k + 1..self.size {
                    let beside = self.place(k, j);
                    if self.filled[beside] {
                        self.take(i, j, inverse.between(&below, &self.blocks[beside]));
                    }
                }
            }
            self.inverses.push(inverse);
        }
        for k in (0..self.size).rev() {
            for j in k + 1..self.size {
                let beside = self.place(k, j);
                if self.filled[beside] {
                    let known = self.blocks[beside].times(&self.twists[j]);
                    self.twists[k] = self.twists[k] - self.inverses[k].times(&known);
                }
            }
        }
        self.twists[..self.size].iter().all(Twist::is_finite)
    }

    /// Returns the twist of body `i`, after [`Self::solve`].
    pub(super) fn twist(&self, i: usize) -> Twist {
        self.twists[i]
    }

    /// Returns the index of a block.
    fn place(&self, i: usize, j: usize) -> usize {
        i * self.size + j
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Random;
    use glam::DVec3;

    const SEED: u64 = 0x501e_0001;

    fn twist(random: &mut Random) -> Twist {
        Twist { angular: random.vector(), linear: random.vector() }
    }

    /// The system is that of bodies on springs, some of which are joined, also by forces that are
    /// not symmetric. If the right-hand side is the product of the matrix and some twists, the
    /// solution must be these twists.
    #[test]
    fn solution_inverts_multiplication_for_any_graph() {
        let mut random = Random::new(SEED);
        for size in [1, 2, 3, 7, 20] {
            let mut system = BlockSystem::new(20);
            let twists: Vec<_> = (0..size).map(|_| twist(&mut random)).collect();
            let mut own: Vec<_> = (0..size).map(|_| SpatialMatrix::ZERO).collect();
            let mut right = vec![Wrench::ZERO; size];
            own.iter_mut().for_each(|matrix| {
                matrix.add_at(DVec3::ZERO, 1e-3);
                matrix.add_turning(1e-5);
            });
            let mut joints = Vec::new();
            for i in 0..size {
                for j in 0..i {
                    if random.unit() < 2.5 / size as f64 {
                        // Vector from the second body's centre to the first body's centre.
                        let shift = DVec3::new(0.1, 0.2, -0.3) * random.unit();
                        let mut joint = SpatialMatrix::ZERO;
                        joint.add_along(DVec3::Y, DVec3::new(random.unit(), 0.0, 0.1), 0.5);
                        joint.add_at(DVec3::X * 0.05, 0.02);
                        let gauge = Wrench::of_force_at(random.vector(), random.vector() * 0.1);
                        joint.add_product(&Wrench::of_force_at(random.vector() * 0.01, DVec3::X * 0.05), &gauge);
                        joints.push((i, j, joint, shift));
                    }
                }
            }
            for (i, j, joint, shift) in &joints {
                own[*i] = own[*i] + *joint;
                own[*j] = own[*j] + joint.to_wrench_at(*shift).from_twist_at(*shift);
                let (one, other) = (twists[*i], twists[*j]);
                let relative = Twist { angular: one.angular - other.angular, linear: one.linear - other.at(*shift) };
                let pressed = joint.times(&relative);
                right[*i] = right[*i] + pressed;
                right[*j] = right[*j] + -pressed.about(-*shift);
            }
            system.begin(size);
            let mut base = SpatialMatrix::ZERO;
            base.add_at(DVec3::ZERO, 1e-3);
            base.add_turning(1e-5);
            for (i, twist) in twists.iter().enumerate() {
                system.set_own(i, own[i], right[i] + base.times(twist));
            }
            for (i, j, joint, shift) in &joints {
                system.take(*i, *j, joint.from_twist_at(*shift));
                system.take(*j, *i, joint.to_wrench_at(*shift));
            }
            assert!(system.solve(), "{size} bodies, seed {SEED:#x}");
            for (i, twist) in twists.iter().enumerate() {
                let found = system.twist(i);
                let off = (found.angular - twist.angular).length() + (found.linear - twist.linear).length();
                assert!(off < 1e-9, "body {i} of {size}, seed {SEED:#x}: {off}");
            }
        }
    }

    #[test]
    fn singular_matrix_is_reported() {
        let mut system = BlockSystem::new(1);
        system.begin(1);
        system.set_own(0, SpatialMatrix::ZERO, Wrench::ZERO);
        assert!(!system.solve());
    }
}
