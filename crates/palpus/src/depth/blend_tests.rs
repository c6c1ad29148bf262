//! How far the blended witness moves when a body moves, over the contacts that make exact witnesses jump: what the tests share.

mod flat;
mod paths;
mod random;

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::*;
use crate::algebra::random::Random;
use crate::algebra::tolerance::{BLEND_PARTED, FRICTION_LEVER};
use crate::algebra::{Placement, Pose};
use crate::body::{FeaturePair, Polytope, Provenance, convex_hull};
use crate::collision::{Proximity, initial_features, march};

const ANGLE: f64 = 5.0 * TAU / 360.0;
const TOLERANCE: f64 = 1e-3;

/// m: apart, touching, deep.
const HEIGHTS: [f64; 6] = [1e-3, 1e-5, 0.0, -1e-5, -1e-4, -1e-3];

const SEED: u64 = 0xB1E4D;

fn solid(points: &[DVec3]) -> Polytope {
    convex_hull(points, 1e-10).unwrap().into_polytope().unwrap().0
}

fn cuboid(half: DVec3) -> Polytope {
    let sign = |bit: u32| if bit == 0 { -1.0 } else { 1.0 };
    solid(&(0..8).map(|k| DVec3::new(sign(k & 1), sign(k & 2), sign(k & 4)) * half).collect::<Vec<_>>())
}

/// A prism along y.
fn prism(sides: u32, radius: f64, half: f64) -> Polytope {
    let corner = |k: u32| {
        let angle = TAU * f64::from(k / 2) / f64::from(sides);
        DVec3::new(radius * angle.sin(), if k.is_multiple_of(2) { half } else { -half }, -radius * angle.cos())
    };
    solid(&(0..2 * sides).map(corner).collect::<Vec<_>>())
}

/// Its top is z = 0.
fn table() -> Polytope {
    let points: Vec<DVec3> =
        cuboid(DVec3::new(0.2, 0.2, 0.025)).vertices().iter().map(|v| *v - DVec3::Z * 0.025).collect();
    solid(&points)
}

fn the_box() -> Polytope {
    cuboid(DVec3::new(0.05, 0.04, 0.03))
}

/// Any rotation.
fn turn(random: &mut Random) -> DQuat {
    DQuat::from_axis_angle(random.vector().normalize(), TAU * random.unit())
}

/// One contact, as the pair query finds it.
#[derive(Clone, Copy, Debug)]
struct Felt {
    exact: DVec3,
    midpoint: DVec3,
    normal: DVec3,
    separation: f64,
    features: FeaturePair,
    walked: Option<Seed>,
    rounds: u32,
    extent: f64,
}

fn felt(a: &Polytope, b: &Polytope, place: &Placement, last: Option<&Felt>, scratch: &mut WalkScratch) -> Felt {
    let start = last.map_or_else(|| initial_features(a, b, place), |last| last.features);
    let marched = march(a, b, place, start);
    let mut walked = None;
    let (touch, separation) = match marched.proximity {
        Proximity::Disjoint(closest) => {
            let crate::collision::Closest { point_a, point_b, normal, distance, features } = closest;
            (Touch { features, point_a, point_b, normal }, distance)
        }
        Proximity::Overlapping(overlap) => {
            let witness = Seed::Witness { direction: overlap.direction };
            let deep = match last.and_then(|last| last.walked) {
                Some(seed) => depth(a, b, place, &[seed, witness], scratch),
                None => depth(a, b, place, &[witness, Seed::CentroidLine], scratch),
            };
            walked = Some(deep.seed());
            let Depth { point_a, point_b, normal, depth, antipodal, .. } = deep;
            (Touch { features: antipodal.features(), point_a, point_b, normal }, -depth)
        }
    };
    let blend = blend(a, b, place, &touch, ANGLE);
    assert!(blend.converged, "{touch:?}");
    let exact = (touch.point_a + touch.point_b) * 0.5;
    let midpoint = exact + blend.shift;
    let features = marched.features;
    Felt {
        exact,
        midpoint,
        normal: touch.normal,
        separation,
        features,
        walked,
        rounds: blend.rounds,
        extent: blend.extent,
    }
}

/// The largest figures along a path.
#[derive(Clone, Copy, Debug)]
struct Figures {
    /// Of a witness step to the motion of the farthest vertex, where the normal does not jump.
    ratio: f64,
    /// The same of the exact witness: how it jumps.
    exact_ratio: f64,
    /// Of a witness step to what the module promises.
    promised: f64,
    /// Largest turn of the normal in a step, rad.
    turn: f64,
    /// Of a witness step to the depth and the motion, where the normal jumps.
    jump: f64,
    separation: [f64; 2],
    rounds: f64,
    most_rounds: u32,
}

impl Figures {
    const NONE: Self = Self {
        ratio: 0.0,
        exact_ratio: 0.0,
        promised: 0.0,
        turn: 0.0,
        jump: 0.0,
        separation: [f64::INFINITY, f64::NEG_INFINITY],
        rounds: 0.0,
        most_rounds: 0,
    };

    /// Of a step from `there` to `here`.
    fn step(
        a: &Polytope,
        b: &Polytope,
        (before, there): (&Placement, &Felt),
        (place, here): (&Placement, &Felt),
    ) -> Self {
        let moved = |v: &DVec3| place.point(*v).distance(before.point(*v));
        let motion = a.vertices().iter().map(moved).fold(0.0, f64::max);
        let step = here.midpoint.distance(there.midpoint);
        let turn = here.normal.angle_between(there.normal);
        let depth = (-here.separation).max(-there.separation);
        // Where they overlap, the blend is that of the pair moved apart.
        let least = BLEND_PARTED * (a.radius() + b.radius());
        let way = |felt: &Felt| felt.normal * (least - felt.separation).max(0.0);
        let parted = way(here).distance(way(there));
        let jumps = depth > 0.0 && turn > 0.1;
        // Each of the six widths is made of two gaps with a pull and twice that without.
        let pull = (0.5 * ANGLE).tan();
        let most = 3f64.sqrt() * (2.14 + pull) / pull * (motion + parted) + 1e-9;
        let (before, now) = (there.extent, here.extent);
        assert!((now - before).abs() <= most, "extent from {before} to {now}, {most} at most");
        Self {
            ratio: if jumps { 0.0 } else { step / motion },
            exact_ratio: here.exact.distance(there.exact) / motion,
            promised: step / (promise() * (motion + parted) + 0.5 * parted),
            turn,
            jump: if jumps { step / (depth + motion) } else { 0.0 },
            separation: [here.separation; 2],
            rounds: f64::from(here.rounds),
            most_rounds: here.rounds,
        }
    }

    fn add(&mut self, step: &Self, weight: f64) {
        self.ratio = self.ratio.max(step.ratio);
        self.exact_ratio = self.exact_ratio.max(step.exact_ratio);
        self.promised = self.promised.max(step.promised);
        self.turn = self.turn.max(step.turn);
        self.jump = self.jump.max(step.jump);
        self.separation = [self.separation[0].min(step.separation[0]), self.separation[1].max(step.separation[1])];
        self.rounds += weight * step.rounds;
        self.most_rounds = self.most_rounds.max(step.most_rounds);
    }
}

impl std::fmt::Display for Figures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { ratio, exact_ratio, promised, turn, jump, separation: [low, high], rounds, most_rounds } = self;
        write!(
            f,
            "witness {ratio:.2} of the motion (exact {exact_ratio:.0}), {promised:.2} of what is promised; normal turns {turn:.1e}, \
             jump {jump:.2} depths; separation {low:.1e} to {high:.1e}; rounds {rounds:.1}, at most {most_rounds}"
        )
    }
}

fn follow(a: &Polytope, b: &Polytope, steps: u32, path: impl Fn(f64) -> Pose) -> Figures {
    let mut scratch = WalkScratch::new();
    let mut figures = Figures::NONE;
    let mut last: Option<(Placement, Felt)> = None;
    for k in 0..=steps {
        let place = path(f64::from(k) / f64::from(steps)).placement();
        let here = felt(a, b, &place, last.as_ref().map(|last| &last.1), &mut scratch);
        assert!(here.midpoint.is_finite());
        if let Some((before, there)) = &last {
            figures.add(&Figures::step(a, b, (before, there), (&place, &here)), 1.0 / f64::from(steps));
        }
        last = Some((place, here));
    }
    figures
}

/// What the module promises of bodies that are apart.
fn promise() -> f64 {
    let pull = (0.5 * ANGLE).tan();
    0.25 * (1.0 + 5f64.sqrt()) * (1.0 + pull) / pull
}

#[allow(clippy::print_stderr, reason = "figures for the record")]
fn check(name: &str, figures: &Figures) {
    eprintln!("{name}: {figures}");
    assert!(figures.promised < 1.0 && figures.ratio < promise(), "{name}: {figures}");
}
