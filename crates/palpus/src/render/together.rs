//! One implicit step of two tools that touch: each tied to its device, both to each other.
//!
//! The step of one tool (`tool.rs`) is linear in its velocity V′ at the end of the step. Two tools that touch share the contacts between
//! them, which are linear in the velocity of the one with respect to the other. So the step of both is one system of twelve unknowns,
//!
//! | A₁ + K   −K T        | V₁′ = b₁ + l
//! | −Tᵀ K    A₂ + Tᵀ K T | V₂′ = b₂ − Tᵀ l
//!
//! with Aᵢ, bᵢ those of the tool alone, K and l those of the contacts between about the first tool's centre of mass, and T what makes
//! of the second's velocity that of its point there. It is definite as the two are, at any stiffness, mass and speed. What the one tool gives the other takes, in the same step: the
//! sum of their momenta does not know of K.
//!
//! Two steps, each with the other tool where it was last, would be no substitute. Contacts are so stiff that a tool which is pushed along at v would be
//! held back with 2 k h v by what it has already left (34 N at 0.1 m/s on a usual device); told the other's velocity as well, the two throw each other to and fro.

use glam::DVec3;

use super::ToolCounters;
use super::tool::{Begun, Tool};
use super::touches::Touches;
use crate::algebra::tolerance::COUPLING_ROUNDS;
use crate::algebra::{SpatialMatrix, Twist, Wrench, solve_definite};

/// One of the two.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there are two in a step, on the stack, since a step obtains no memory")]
pub(super) enum Side<'a> {
    /// A tool that the step moves.
    Held(&'a mut Tool, Begun),
    /// A body that moves as it moves: the velocity of its centre of mass.
    Driven(Twist),
}

/// The contacts between the two.
#[derive(Debug)]
pub(super) struct Shared<'a> {
    /// About the first one's centre of mass.
    pub(super) touches: &'a mut Touches,
    /// From the second one's centre of mass to the first one's, m.
    pub(super) shift: DVec3,
    /// s: their damping over their stiffness.
    pub(super) lag: f64,
}

/// A step of both, solved.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Settled {
    /// The velocities of both at its end.
    pub(super) twists: [Twist; 2],
    /// N·s and N·m·s: what the contacts between the two gave the first one, about its centre of mass.
    pub(super) impulse: Wrench,
}

/// The velocities of both at the end of a step of `h` seconds; `None` if the system has no finite solution.
pub(super) fn settle(
    sides: &mut [Side<'_>; 2],
    shared: &mut Shared<'_>,
    h: f64,
    counters: &mut ToolCounters,
) -> Option<Settled> {
    let mut settled = Settled::default();
    for round in 1..=COUPLING_ROUNDS {
        settled = solve(sides, shared, h)?;
        let twists = settled.twists;
        counters.rounds = round;
        let mut news = shared.touches.revise(&relative(&twists, shared.shift), h, shared.lag);
        for (side, twist) in sides.iter_mut().zip(&twists) {
            if let Side::Held(tool, _) = side {
                news |= tool.revise(twist, h);
            }
        }
        if !news {
            return Some(settled);
        }
    }
    counters.unsettled = 1;
    Some(settled)
}

/// The first one's velocity with respect to the second, about the first one's centre of mass.
fn relative([first, second]: &[Twist; 2], shift: DVec3) -> Twist {
    Twist { angular: first.angular - second.angular, linear: first.linear - second.at(shift) }
}

/// The system with the contacts that press and hold as of now, solved.
fn solve(sides: &[Side<'_>; 2], shared: &Shared<'_>, h: f64) -> Option<Settled> {
    let (mut between, mut given) = (SpatialMatrix::ZERO, Wrench::ZERO);
    shared.touches.add_to(&mut between, &mut given, h, shared.lag);
    let alone = sides.each_ref().map(|side| match side {
        Side::Held(tool, begun) => tool.hindered(begun, h),
        Side::Driven(_) => (SpatialMatrix::ZERO, Wrench::ZERO),
    });
    let [(first, load), (second, other_load)] = alone;
    let taken = |wrench: Wrench| -wrench.about(-shared.shift);
    let answer = |twists: &[Twist; 2]| {
        let pressed = between.times(&relative(twists, shared.shift));
        numbers(&[first.times(&twists[0]) + pressed, second.times(&twists[1]) + taken(pressed)])
    };
    let mut matrix = [[0.0; 12]; 12];
    for j in 0..12 {
        let column = answer(&unit(j));
        for (row, entry) in matrix.iter_mut().zip(column) {
            row[j] = entry;
        }
    }
    let mut right = numbers(&[load + given, other_load + taken(given)]);
    for (k, side) in sides.iter().enumerate() {
        if let Side::Driven(twist) = side {
            fix(&mut matrix, &mut right, 6 * k, &[twist.angular.to_array(), twist.linear.to_array()]);
        }
    }
    let solution = solve_definite(matrix, right)?;
    let vector = |k: usize| DVec3::new(solution[k], solution[k + 1], solution[k + 2]);
    let twists = [0, 6].map(|k| Twist { angular: vector(k), linear: vector(k + 3) });
    let impulse = given + -between.times(&relative(&twists, shared.shift));
    Some(Settled { twists, impulse })
}

/// The unknowns from `start` on are known: `values`.
fn fix(matrix: &mut [[f64; 12]; 12], right: &mut [f64; 12], start: usize, values: &[[f64; 3]; 2]) {
    for (k, &value) in values.as_flattened().iter().enumerate() {
        let j = start + k;
        for i in 0..12 {
            right[i] -= matrix[i][j] * value;
            (matrix[i][j], matrix[j][i]) = (0.0, 0.0);
        }
        (matrix[j][j], right[j]) = (1.0, value);
    }
    // What one known number took from another's row was not its to take.
    right[start..start + 6].copy_from_slice(values.as_flattened());
}

/// Nothing but unknown number `j` at 1.
fn unit(j: usize) -> [Twist; 2] {
    let axis = |start: usize| DVec3::from_array([0, 1, 2].map(|k| if start + k == j { 1.0 } else { 0.0 }));
    [0, 6].map(|k| Twist { angular: axis(k), linear: axis(k + 3) })
}

fn numbers([first, second]: &[Wrench; 2]) -> [f64; 12] {
    let parts = [first.torque, first.force, second.torque, second.force].map(|part| part.to_array());
    let mut all = [0.0; 12];
    all.copy_from_slice(parts.as_flattened());
    all
}
