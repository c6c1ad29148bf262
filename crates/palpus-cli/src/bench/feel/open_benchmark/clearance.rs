//! Parts with a known play, as scenes of the benchmark: measures how far the probe moves sideways
//! without a force, and the force of a press beyond this motion.
//!
//! The probe starts in the middle of its play. In each of eight directions it moves to [`PRESS`]
//! beyond first touch, stays there, and returns. An engine's *free travel* ends where the force
//! first exceeds [`FELT`]. The separation at which the engine begins to push is added, so that the
//! true value is the play. While the probe stays, the true force is the stiffness times the sum of
//! the press and this separation, opposite to the direction. All contacts of a scene lie within its
//! cluster radius and share one stiffness.
//!
//! The play of round parts follows from their diameters. For threads and teeth, only the smallest
//! gap is known, which was measured on the meshes. The play of threads and teeth is at least this
//! gap.

use std::f64::consts::TAU;
use std::path::Path;

use anyhow::Context;
use glam::DVec3;
use palpus::algebra::{Pose, Twist, Wrench};
use palpus::body::PolygonSoup;
use palpus::render::ProbeState;
use palpus_scenes::{ContactSettings, HandPath, Key, Scene};

use super::super::ground::Ground;
use super::super::method::ContactOffset;
use super::super::open::angle_between;
use super::super::row::{Rows, largest, mean};
use crate::bench::TICK;
use crate::bench::table::find;
use crate::bodies;

/// Two parts and their play; all lengths in m.
pub(super) struct Fit {
    pub(super) name: &'static str,
    probe: &'static str,
    environment: &'static str,
    /// Translation from the probe's pose in the files to the middle of its play.
    lift: f64,
    /// Position of the contact in the environment's file: the middle of the contact.
    middle: DVec3,
    /// Play on each side.
    play: f64,
    /// False if only a lower bound of the play is known.
    pub(super) is_exact: bool,
}

pub(super) const FITS: [Fit; 7] = [
    // A peg of 7.995 mm in a hole of 8.1 mm.
    Fit {
        name: "fit-peg-tight",
        probe: "peg_round_8mm_tight_factory.obj",
        environment: "hole_round_8mm_factory.obj",
        lift: 0.0,
        middle: DVec3::new(0.0, 0.0, 0.0045),
        play: 0.000_052_5,
        is_exact: true,
    },
    // The hole is stated as 8.1 mm, but its mesh has 9 mm. The play was measured on the mesh.
    Fit {
        name: "fit-peg",
        probe: "peg_round_8mm.obj",
        environment: "hole_round_8mm.obj",
        lift: 0.002,
        middle: DVec3::new(0.0, 0.0, 0.0165),
        play: 0.000_506_3,
        is_exact: true,
    },
    // Bores of 10 mm on shafts of 9 mm.
    shaft("fit-gear-small", "gear_small.obj", 0.050_75),
    shaft("fit-gear-medium", "gear_medium.obj", 0.020_25),
    shaft("fit-gear-large", "gear_large.obj", -0.030_25),
    Fit {
        name: "fit-gear-teeth",
        probe: "gear_medium.obj",
        environment: "gear_large.obj",
        lift: 0.0,
        middle: DVec3::new(0.0, 0.0, 0.015),
        play: 0.000_179_2,
        is_exact: false,
    },
    Fit {
        name: "fit-nut-bolt",
        probe: "nut_m16_loose.obj",
        environment: "bolt_m16_loose.obj",
        lift: 0.002_05,
        middle: DVec3::new(0.0, 0.0, 0.0245),
        play: 0.000_057_5,
        is_exact: false,
    },
];

const fn shaft(name: &'static str, probe: &'static str, x: f64) -> Fit {
    let middle = DVec3::new(x, 0.0, 0.0155);
    Fit { name, probe, environment: "gear_base.obj", lift: 0.001, middle, play: 0.0005, is_exact: true }
}

const DIRECTIONS: usize = 8;
/// Number of ticks of the motion outward, and of the motion back.
const OUT: usize = 300;
/// Number of ticks of the stay outside.
const HOLD: usize = 100;
/// Number of ticks of the stay in the middle.
const REST: usize = 50;
/// Number of ticks for one direction.
const ROUND: usize = 2 * OUT + HOLD + REST;
/// Distance of the hand's target beyond first touch, m.
const PRESS: f64 = 5e-5;
/// Contact stiffness, N/m.
const STIFFNESS: f64 = 1000.0;
/// The separation at which contacts push, as a share of the play.
const TOLERANCE: f64 = 0.1;
/// Cluster radius, m. It is larger than the parts, so that all contacts share one stiffness.
const CLUSTER: f64 = 0.1;
/// Force above which contact counts as felt, N: the stiffness times a micrometre.
const FELT: f64 = 1e-3;

/// Returns the `k`-th unit vector across the play. The first vector is not along an axis of the
/// mesh.
fn direction(k: usize) -> DVec3 {
    let (sin, cos) = ((k as f64 + 0.25) / DIRECTIONS as f64 * TAU).sin_cos();
    DVec3::new(cos, sin, 0.0)
}

impl Fit {
    pub(super) fn of(name: &str) -> Option<&'static Self> {
        FITS.iter().find(|fit| fit.name == name)
    }

    /// Returns the scene of the fit; `None` if its models are neither in `folder` nor in a
    /// subfolder.
    pub(super) fn ground(&'static self, folder: &Path) -> anyhow::Result<Option<Ground>> {
        let files = [self.probe, self.environment].map(|file| find(folder, file));
        let [Some(probe), Some(environment)] = files else { return Ok(None) };
        let read = |file: &Path, shift: DVec3| {
            let mut soup = bodies::read_mesh(file).with_context(|| format!("{} cannot be read", file.display()))?;
            soup.vertices.iter_mut().for_each(|vertex| *vertex += shift);
            anyhow::Ok(soup)
        };
        let probe = read(&probe, DVec3::Z * self.lift - self.middle)?;
        let environment = read(&environment, -self.middle)?;
        let mut ground = Ground::unscripted(&self.scene(probe, environment))?;
        ground.script = self.script();
        Ok(Some(ground))
    }

    fn scene(&self, probe: PolygonSoup, environment: PolygonSoup) -> Scene {
        let contact = ContactSettings {
            tolerance: TOLERANCE * self.play,
            cluster_radius: CLUSTER,
            stiffness: STIFFNESS,
            friction: None,
            shading: false,
            crease: 0.0,
        };
        let path = HandPath::through(&[0.0, 1.0].map(|time| Key::rest(time, Pose::IDENTITY)));
        let summary = "parts with a known play";
        Scene {
            name: self.name,
            summary,
            probe,
            environment,
            contact,
            start: Pose::IDENTITY,
            path,
            second: None,
            objects: Vec::new(),
            gravity: DVec3::ZERO,
        }
    }

    /// Returns the distance of the probe from the middle in tick `k` of a round, m.
    fn travel(&self, k: usize) -> f64 {
        let end = self.play + PRESS;
        match k {
            k if k < OUT => end * k as f64 / OUT as f64,
            k if k < OUT + HOLD => end,
            k if k < 2 * OUT + HOLD => end * (2 * OUT + HOLD - k) as f64 / OUT as f64,
            _ => 0.0,
        }
    }

    /// Returns a vector opposite to the direction of motion. Its length is the distance by which
    /// the probe is beyond first touch, m.
    pub(super) fn overlap(&self, probe: &ProbeState) -> DVec3 {
        let way = probe.pose_ba.translation;
        -way.normalize_or_zero() * (way.length() - self.play).max(0.0)
    }

    fn script(&self) -> Vec<ProbeState> {
        let place = |k: usize| direction(k / ROUND) * self.travel(k % ROUND);
        (0..DIRECTIONS * ROUND)
            .map(|k| {
                let linear = if k == 0 { DVec3::ZERO } else { (place(k) - place(k - 1)) / TICK };
                let twist = Twist { linear, ..Twist::default() };
                ProbeState { pose_ba: Pose::from_translation(place(k)), twist }
            })
            .collect()
    }

    /// Adds the measures of the answers to the script.
    pub(super) fn judge(&self, ground: &Ground, contact_offset: ContactOffset, wrenches: &[Wrench], rows: &mut Rows) {
        let contact_offset = contact_offset.width(ground);
        let step = (self.play + PRESS) / OUT as f64;
        let (mut wrong, mut short, mut sizes, mut turns, mut unfelt) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new(), 0);
        for (k, round) in wrenches.chunks_exact(ROUND).enumerate() {
            // The force begins between two ticks.
            let felt = round[..OUT + HOLD].iter().position(|wrench| wrench.force.length() > FELT);
            let Some(felt) = felt else {
                unfelt += 1;
                continue;
            };
            let travel = self.travel(felt) + contact_offset - step / 2.0;
            if self.is_exact {
                wrong.push((travel - self.play).abs());
                let held = round[OUT + HOLD - 1].force;
                sizes.push(held.length() / (STIFFNESS * (PRESS + contact_offset)));
                turns.push(angle_between(held, -direction(k)));
            }
            short.push(self.play - travel);
        }
        rows.add("", "never felt", "", f64::from(unfelt));
        rows.add("", "free travel short by", "m", largest(&short));
        if self.is_exact && !wrong.is_empty() {
            rows.add("", "free travel error", "m", largest(&wrong));
            rows.add("", "press over k", "", mean(&sizes));
            rows.add("", "press direction error", "°", largest(&turns));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpus_scenes::shape;

    /// A wall all around at the distance of the play is judged correct if its force is k times the
    /// overlap. The wall is judged wrong if the force begins a tenth of the play too early.
    #[test]
    fn travel_and_press_are_judged() {
        let fit = &FITS[1];
        let cube = shape::cuboid(DVec3::splat(0.01));
        let mut ground = Ground::unscripted(&fit.scene(cube.clone(), cube)).expect("the scene is valid");
        ground.script = fit.script();
        let value = |early: f64, measure: &str| {
            let earlier = Fit { play: fit.play - early, ..FITS[1] };
            let force = |probe: &ProbeState| earlier.overlap(probe) * STIFFNESS;
            let wrenches: Vec<Wrench> =
                ground.script.iter().map(|probe| Wrench { force: force(probe), torque: DVec3::ZERO }).collect();
            let mut rows = Rows::new(fit.name, "wall");
            fit.judge(&ground, ContactOffset::Surface, &wrenches, &mut rows);
            rows.rows
                .iter()
                .find(|row| row.measure == measure)
                .map(|row| row.value)
                .expect("the measure is in the table")
        };
        // The allowed error covers the motion in one tick, and the motion until the force exceeds
        // [`FELT`].
        assert!(value(0.0, "free travel error") < 4e-6);
        assert!((value(0.0, "press over k") - 1.0).abs() < 1e-9);
        assert!(value(0.0, "press direction error") < 1e-6);
        assert!(value(0.1 * fit.play, "free travel short by") > 0.09 * fit.play - 4e-6);
        assert!(value(0.1 * fit.play, "press over k") > 1.9);
    }
}
