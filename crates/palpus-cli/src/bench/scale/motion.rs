//! Coherent motions that keep two bodies in contact.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus::body::Body;
use palpus::detect::{ContactQuery, QuerySettings};

use palpus::algebra::Random;

/// Motion of a probe.
#[derive(Clone, Copy, Debug)]
pub(super) enum Motion {
    /// The probe approaches from a random side until it touches. Then it moves in and out between
    /// first touch and a depth of one amplitude, and sideways. It never backs off along the
    /// approach, so that both the median tick and the slowest tick have contact.
    Orbit,
    /// The probe turns to and fro about an axis of the environment's frame through `center`,
    /// advances with the turn like a screw, and sways.
    Screw {
        /// Position of the probe's frame at rest, m.
        rest: DVec3,
        /// A point of the axis, m. The axis is parallel to z.
        center: DVec3,
        /// The largest turn to each side, rad.
        swing: f64,
        /// Advance in a full turn, m.
        pitch: f64,
        /// Largest displacement across the axis, m.
        sway: f64,
        /// Largest displacement along the axis to each side, in addition to the advance, m.
        lift: f64,
    },
}

/// Number of ticks in which a hand moves to and fro once: two periods per second.
pub(in crate::bench) const PERIOD: f64 = 500.0;
/// Largest number of ticks in a stretch.
pub(super) const STRETCH: usize = 2000;

/// Returns stretches of poses of a in b's frame: `ticks` poses in total, not counting the first
/// pose of each stretch.
///
/// `amplitude` (m): the depth of an orbit, and its sideways distance to each side.
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
                    // The sway has another frequency than the turn, so that every side is touched.
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

/// Returns the query for [`Orbit::touching`]: nearest points at any distance.
pub(in crate::bench) fn nearest_query(a: &Arc<Body>, b: &Arc<Body>) -> ContactQuery {
    let settings = QuerySettings { tolerance: 0.0, capacity: 1 << 14, ..QuerySettings::default() };
    ContactQuery::new(a.clone(), b.clone(), settings)
}

/// Motion about a place at which the bodies touch.
pub(super) struct Orbit {
    touch: Pose,
    /// Centre of the probe, in its frame.
    middle: DVec3,
    outward: DVec3,
    sideways: DVec3,
    spin: DVec3,
    amplitude: f64,
}

/// Largest rotation of the probe to each side in an orbit, rad.
const ORBIT_TURN: f64 = 0.02;
/// Largest number of steps of the search for first touch; the gap shrinks geometrically.
const MOST_ADVANCES: usize = 200;
/// Gap that counts as touching, as a share of the amplitude.
const TOUCHING: f64 = 0.01;

impl Orbit {
    /// Returns a touching pose that the probe reaches from a random side.
    pub(super) fn touching(query: &mut ContactQuery, amplitude: f64, random: &mut Random) -> Self {
        let (a, b) = (query.a().clone(), query.b().clone());
        loop {
            let turn = DQuat::from_scaled_axis(random.vector() * TAU / 2.0);
            let approach = random.vector().normalize_or(DVec3::Z);
            let bounds = |body: &Body| (body.mesh().bounds().min + body.mesh().bounds().max) / 2.0;
            let (middle, goal) = (bounds(&a), bounds(&b));
            let at = |way: f64| Pose::new(turn, goal - turn * middle + approach * way);
            // Conservative advancement: a step of the nearest distance cannot cause overlap.
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
            // The approach went through a hole, so another side is tried.
            if gap <= TOUCHING * amplitude {
                let sideways = outward.cross(random.vector()).normalize_or(outward.any_orthonormal_vector());
                return Self { touch: at(way), middle, outward, sideways, spin: random.vector(), amplitude };
            }
        }
    }

    /// Returns the pose at `phase` of a slide by up to `sideways` (m) to each side that sinks from
    /// touch (phase 0) to `depth` (m).
    pub(super) fn slide(&self, phase: f64, sideways: f64, depth: f64) -> Pose {
        let (sin, cos) = phase.sin_cos();
        let shift = self.sideways * (sideways * sin) - self.outward * (0.5 * depth * (1.0 - cos));
        Pose { translation: self.touch.translation + shift, ..self.touch }
    }

    /// Returns the pose at `phase`. At phase 0 the bodies touch. At half a period they are deeper
    /// by one amplitude along the normal. On curved surfaces, the sideways motion and the rotation
    /// may still separate them.
    fn pose(&self, phase: f64) -> Pose {
        let (sin, cos) = phase.sin_cos();
        let spin = DQuat::from_scaled_axis(self.spin * (ORBIT_TURN * sin));
        let middle = self.touch.point(self.middle);
        let shift = self.outward * (self.amplitude * (cos - 1.0) / 2.0) + self.sideways * (self.amplitude * sin);
        let rotation = spin * self.touch.rotation;
        Pose::new(rotation, middle + shift - rotation * self.middle)
    }
}
