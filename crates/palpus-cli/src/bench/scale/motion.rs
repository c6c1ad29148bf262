//! Coherent motions that keep two bodies in contact.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus::body::Body;
use palpus::detect::{ContactQuery, QuerySettings};

use palpus::algebra::Random;

/// How a probe moves.
#[derive(Clone, Copy, Debug)]
pub(super) enum Motion {
    /// Approaches from a random side until it touches, then goes in and out between touching and an
    /// amplitude deep, and sideways: along the approach it never backs off, so that the median tick
    /// is one of contact as the slowest are.
    Orbit,
    /// Turns to and fro about an axis of the environment's frame through `center`, advances with
    /// the turn as a screw does, and sways.
    Screw {
        /// Position of the probe's frame at rest, m.
        rest: DVec3,
        /// A point of the axis (its direction is z), m.
        center: DVec3,
        /// The largest turn to each side, rad.
        swing: f64,
        /// Advance in a whole turn, m.
        pitch: f64,
        /// The largest way across the axis, m.
        sway: f64,
        /// The largest way along the axis to each side, besides the screw's, m.
        lift: f64,
    },
}

/// Ticks in which a hand goes to and fro: two a second.
pub(in crate::bench) const PERIOD: f64 = 500.0;
/// Ticks of a stretch, at the most.
pub(super) const STRETCH: usize = 2000;

/// Stretches of poses of a in b's frame: `ticks` poses in all, not counting the first pose of each
/// stretch.
///
/// `amplitude` (m) is how far an orbit goes in, and sideways to each side.
pub(super) fn stretches(
    motion: &Motion,
    a: &Arc<Body>,
    b: &Arc<Body>,
    amplitude: f64,
    ticks: usize,
    random: &mut Random,
) -> Vec<Vec<Pose>> {
    let mut query = nearest_query(a, b);
    let mut answer = Vec::new();
    let mut left = ticks;
    while left > 0 {
        let count = left.min(STRETCH);
        left -= count;
        let poses = 0..=count;
        answer.push(match *motion {
            Motion::Orbit => {
                let orbit = Orbit::touching(&mut query, amplitude, random);
                poses.map(|k| orbit.pose(TAU * k as f64 / PERIOD)).collect()
            }
            Motion::Screw { rest, center, swing, pitch, sway, lift } => {
                let begin = random.signed() * TAU;
                let screw = |k: usize| {
                    let phase = begin + TAU * k as f64 / PERIOD;
                    let angle = swing * phase.sin();
                    let turn = DQuat::from_rotation_z(angle);
                    // Another frequency, so that every side is touched at every turn.
                    let (sin, cos) = (0.77 * phase).sin_cos();
                    let across = DVec3::new(cos, sin, 0.0) * sway;
                    let along = DVec3::Z * (pitch * angle / TAU + lift * (0.5 * phase).cos());
                    Pose::new(turn, center + turn * (rest - center) + across + along)
                };
                poses.map(screw).collect()
            }
        });
    }
    answer
}

/// Returns the query that [`Orbit::touching`] asks: for the nearest points, whatever the distance.
pub(in crate::bench) fn nearest_query(a: &Arc<Body>, b: &Arc<Body>) -> ContactQuery {
    let settings = QuerySettings { tolerance: 0.0, capacity: 1 << 14, ..QuerySettings::default() };
    ContactQuery::new(a.clone(), b.clone(), settings)
}

/// About a place where the bodies touch.
pub(super) struct Orbit {
    touch: Pose,
    /// Centre of the probe, in its frame.
    middle: DVec3,
    outward: DVec3,
    sideways: DVec3,
    spin: DVec3,
    amplitude: f64,
}

/// An orbit turns the probe by this much to each side, rad.
const ORBIT_TURN: f64 = 0.02;
/// Steps of the search for first touch; the gap shrinks geometrically.
const MOST_ADVANCES: usize = 200;
/// Gap that counts as touching, as a share of the amplitude.
const TOUCHING: f64 = 0.01;

impl Orbit {
    /// A place to which the probe comes from a random side.
    pub(super) fn touching(query: &mut ContactQuery, amplitude: f64, random: &mut Random) -> Self {
        let (a, b) = (query.a().clone(), query.b().clone());
        loop {
            let turn = DQuat::from_scaled_axis(random.vector() * TAU / 2.0);
            let approach = random.vector().normalize_or(DVec3::Z);
            let bounds = |body: &Body| (body.mesh().bounds().min + body.mesh().bounds().max) / 2.0;
            let (middle, goal) = (bounds(&a), bounds(&b));
            let at = |way: f64| Pose::new(turn, goal - turn * middle + approach * way);
            // Conservative advancement: the nearest distance can always be travelled.
            let mut way = a.size() + b.size();
            let (mut gap, mut outward) = (f64::INFINITY, approach);
            for _ in 0..MOST_ADVANCES {
                let nearest = query.nearest(&at(way));
                (gap, outward) = nearest.map_or((0.0, approach), |contact| (contact.separation, contact.normal));
                if gap <= TOUCHING * amplitude || way < -b.size() {
                    break;
                }
                way -= gap;
            }
            // Straight through a hole: another side.
            if gap <= TOUCHING * amplitude {
                let sideways = outward.cross(random.vector()).normalize_or(outward.any_orthonormal_vector());
                return Self { touch: at(way), middle, outward, sideways, spin: random.vector(), amplitude };
            }
        }
    }

    /// Slides by up to `sideways` to each side and sinks from touch to `depth`; phase 0 is touch.
    pub(super) fn slide(&self, phase: f64, sideways: f64, depth: f64) -> Pose {
        let (sin, cos) = phase.sin_cos();
        let shift = self.sideways * (sideways * sin) - self.outward * (0.5 * depth * (1.0 - cos));
        Pose { translation: self.touch.translation + shift, ..self.touch }
    }

    /// At phase 0 the bodies touch, at half a turn they are an amplitude deeper along the normal.
    /// The sideways way and the turn may still part them on curved surfaces.
    fn pose(&self, phase: f64) -> Pose {
        let (sin, cos) = phase.sin_cos();
        let spin = DQuat::from_scaled_axis(self.spin * (ORBIT_TURN * sin));
        let middle = self.touch.point(self.middle);
        let shift = self.outward * (self.amplitude * (cos - 1.0) / 2.0) + self.sideways * (self.amplitude * sin);
        let rotation = spin * self.touch.rotation;
        Pose::new(rotation, middle + shift - rotation * self.middle)
    }
}
