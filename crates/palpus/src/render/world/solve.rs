//! The linear system of the bodies that one implicit step moves together. Its matrix consists of
//! 6×6 blocks: a diagonal block for each body, and an off-diagonal block for each pair of bodies in
//! contact.
//!
//! The matrix is symmetric and positive definite, so it has a Cholesky factorisation. The
//! factorisation is computed block by block, and zero blocks are skipped. Bodies with few
//! neighbours should come first, because the elimination of a body couples all of its remaining
//! neighbours (fill-in).

use glam::DVec3;

use crate::algebra::{Twist, Wrench};

/// A matrix of 6×6; rotation before translation.
pub(super) type Block = [[f64; 6]; 6];

const ZERO: Block = [[0.0; 6]; 6];

/// See the module's description.
#[derive(Clone, Debug)]
pub(super) struct BlockSystem {
    /// Lower triangle, row by row.
    blocks: Vec<Block>,
    /// True for each block that is not zero.
    filled: Vec<bool>,
    right: Vec<[f64; 6]>,
    /// Number of bodies.
    size: usize,
}

impl BlockSystem {
    /// Allocates memory for at most `most` bodies.
    pub(super) fn new(most: usize) -> Self {
        let count = most * (most + 1) / 2;
        Self { blocks: vec![ZERO; count], filled: vec![false; count], right: vec![[0.0; 6]; most], size: 0 }
    }

    /// Returns an empty system of `size` bodies.
    pub(super) fn begin(&mut self, size: usize) {
        self.size = size;
        self.filled[..size * (size + 1) / 2].fill(false);
        self.right[..size].fill([0.0; 6]);
    }

    /// Sets the diagonal block and the right-hand side of body `i`.
    pub(super) fn set_own(&mut self, i: usize, block: Block, right: &Wrench) {
        let at = place(i, i);
        (self.blocks[at], self.filled[at]) = (block, true);
        let Wrench { torque, force } = right;
        self.right[i] = [torque.x, torque.y, torque.z, force.x, force.y, force.z];
    }

    /// Subtracts `block` from the block in row `i` and column `j`, and its transpose from the block
    /// in row `j` and column `i`.
    pub(super) fn take_between(&mut self, i: usize, j: usize, block: &Block) {
        let at = place(i.max(j), i.min(j));
        if !std::mem::replace(&mut self.filled[at], true) {
            self.blocks[at] = ZERO;
        }
        let held = &mut self.blocks[at];
        for r in 0..6 {
            for c in 0..6 {
                held[r][c] -= if i > j { block[r][c] } else { block[c][r] };
            }
        }
    }

    /// Solves the system. Returns false if the matrix is not positive definite, even if only
    /// because of rounding.
    #[must_use]
    pub(super) fn solve(&mut self) -> bool {
        for k in 0..self.size {
            let Some(factor) = factored(&self.blocks[place(k, k)]) else { return false };
            self.blocks[place(k, k)] = factor;
            solve_lower(&factor, &mut self.right[k]);
            let solved = self.right[k];
            for i in k + 1..self.size {
                if self.filled[place(i, k)] {
                    let block = &mut self.blocks[place(i, k)];
                    block.iter_mut().for_each(|row| solve_lower(&factor, row));
                    subtract(&mut self.right[i], |r| dot(&block[r], &solved));
                }
            }
            self.eliminate(k);
        }
        for k in (0..self.size).rev() {
            let mut right = self.right[k];
            for i in k + 1..self.size {
                if self.filled[place(i, k)] {
                    let (block, other) = (&self.blocks[place(i, k)], &self.right[i]);
                    subtract(&mut right, |c| (0..6).map(|r| block[r][c] * other[r]).sum());
                }
            }
            solve_upper(&self.blocks[place(k, k)], &mut right);
            self.right[k] = right;
        }
        self.right[..self.size].iter().flatten().all(|x| x.is_finite())
    }

    /// Returns the twist of body `i`, after [`Self::solve`].
    pub(super) fn twist(&self, i: usize) -> Twist {
        let [a, b, c, d, e, f] = self.right[i];
        Twist { angular: DVec3::new(a, b, c), linear: DVec3::new(d, e, f) }
    }

    /// Eliminates body `k`: adds the terms that couple its neighbours with each other.
    fn eliminate(&mut self, k: usize) {
        for i in k + 1..self.size {
            if !self.filled[place(i, k)] {
                continue;
            }
            for j in k + 1..=i {
                if !self.filled[place(j, k)] {
                    continue;
                }
                let (one, other) = (self.blocks[place(i, k)], self.blocks[place(j, k)]);
                let at = place(i, j);
                if !std::mem::replace(&mut self.filled[at], true) {
                    self.blocks[at] = ZERO;
                }
                for (row, line) in self.blocks[at].iter_mut().zip(&one) {
                    subtract(row, |c| dot(line, &other[c]));
                }
            }
        }
    }
}

/// Returns the index of block (i, j), with j ≤ i.
fn place(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

fn dot(one: &[f64; 6], other: &[f64; 6]) -> f64 {
    one.iter().zip(other).map(|(x, y)| x * y).sum()
}

fn subtract(row: &mut [f64; 6], what: impl Fn(usize) -> f64) {
    for (k, number) in row.iter_mut().enumerate() {
        *number -= what(k);
    }
}

/// Returns the Cholesky factor L of a block L Lᵀ, with zeros above the diagonal; `None` if the
/// block is not positive definite.
fn factored(block: &Block) -> Option<Block> {
    let mut factor = ZERO;
    for i in 0..6 {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
            let left = block[i][j] - sum;
            factor[i][j] = if i > j {
                left / factor[j][j]
            } else if left > 0.0 && left.is_finite() {
                left.sqrt()
            } else {
                return None;
            };
        }
    }
    Some(factor)
}

/// Replaces `row` by the solution y of L y = row.
fn solve_lower(factor: &Block, row: &mut [f64; 6]) {
    for i in 0..6 {
        let sum: f64 = (0..i).map(|k| factor[i][k] * row[k]).sum();
        row[i] = (row[i] - sum) / factor[i][i];
    }
}

/// Replaces `row` by the solution x of Lᵀ x = row.
fn solve_upper(factor: &Block, row: &mut [f64; 6]) {
    for i in (0..6).rev() {
        let sum: f64 = (i + 1..6).map(|k| factor[k][i] * row[k]).sum();
        row[i] = (row[i] - sum) / factor[i][i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Random;
    use crate::algebra::SpatialMatrix;

    const SEED: u64 = 0x501e_0001;

    fn twist(random: &mut Random) -> Twist {
        Twist { angular: random.vector(), linear: random.vector() }
    }

    /// The system is that of bodies on springs, some of which are joined. If the right-hand side is
    /// the product of the matrix and some twists, the solution must be these twists.
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
                        joints.push((i, j, joint, shift));
                    }
                }
            }
            for (i, j, joint, shift) in &joints {
                own[*i] = own[*i] + *joint;
                own[*j] = own[*j] + joint.about(*shift);
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
                system.set_own(i, own[i].to_rows(), &(right[i] + base.times(twist)));
            }
            for (i, j, joint, shift) in &joints {
                system.take_between(*i, *j, &joint.across(*shift));
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
    fn indefinite_matrix_is_reported() {
        let mut system = BlockSystem::new(1);
        system.begin(1);
        system.set_own(0, ZERO, &Wrench::ZERO);
        assert!(!system.solve());
    }
}
