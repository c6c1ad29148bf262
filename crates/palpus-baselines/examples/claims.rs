//! Measures the claims of [K02] about [16] and [30]: runs every method along the same slow scripted
//! motions, with direct rendering.
//!
//! `cargo run --release -p palpus-baselines --example claims [SCENE…]` prints one table per scene:
//!
//! * force, torque: mean size during contact;
//! * step: change within one millisecond, largest value and 99.9 % quantile, for force and torque.
//!   "of mean" is the largest force step relative to the mean force;
//! * springs: largest ratio of a force step to the step of one spring with the scene's stiffness
//!   for the same motion;
//! * turn: largest change of the force direction within a millisecond, degrees, for forces of at
//!   least a tenth of the mean;
//! * truth: root mean square error of the force against the scene's true force, relative to the
//!   true force, if the scene has one;
//! * fitted: the error "truth" after the force was scaled by the best factor, which removes the
//!   error of the stiffness;
//! * lost: fraction of the steps with an overlap in which the method gives no force. The overlap is
//!   that of the true contact; if the scene has no true contact, palpus measures the overlap;
//! * at: time of the largest force step.
//!
//! The rows marked "coupled" use a virtual coupling of 1000 N/m and 0.5 N·m/rad with a tool of 50
//! g. The other rows use direct rendering. The scripted motion is slowed down four times and
//! sampled every millisecond. There is no friction and no force shading.
#![allow(clippy::print_stdout, reason = "an example that prints a table")]

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::{NoClock, Twist, Wrench, quantile};
use palpus::body::{Body, BodySettings};
use palpus::render::{Clustering, Limits, ProbeState, Renderer, VirtualCoupling};
use palpus_baselines::{
    Baseline, Beyond, Change, Coupled, CouplingSettings, Epa, Felt, Predicted, PredictedSettings, Settings, Voxel,
    VoxelSettings,
};
use palpus_scenes::truth::Truth;
use palpus_scenes::{Scene, scene};

const TICK: f64 = 1e-3;
/// Factor by which the script is slowed down, so that force steps come from the method and not from
/// the motion.
const SLOWER: f64 = 4.0;

/// The palpus engine as a [`Baseline`].
struct Engine(Renderer, &'static str);

impl Baseline for Engine {
    fn name(&self) -> &'static str {
        self.1
    }

    fn step(&mut self, pose_ba: &palpus::algebra::Pose, twist: &Twist, dt: f64) -> Felt {
        let tick = self.0.step(&ProbeState { pose_ba: *pose_ba, twist: *twist }, dt, &NoClock);
        let deepest = tick.contacts.iter().map(|contact| contact.separation).fold(f64::INFINITY, f64::min);
        Felt { wrench: tick.commanded, deepest, contacts: tick.contacts.len() }
    }

    fn clear(&mut self) {
        self.0.clear();
    }
}

/// A method, and a note that is printed after its name.
type Row = (Box<dyn Baseline>, &'static str);

fn methods(a: &Arc<Body>, b: &Arc<Body>, scene: &Scene) -> Result<Vec<Row>, Box<dyn std::error::Error>> {
    let (tolerance, stiffness) = (scene.contact.tolerance, scene.contact.stiffness);
    let contact = Settings { tolerance, stiffness, grip_a: DVec3::ZERO };
    let engine = |clustering, coupling, name, note| -> Result<Row, Box<dyn std::error::Error>> {
        let settings = palpus::render::Settings {
            contact_tolerance: tolerance,
            cluster_radius: scene.contact.cluster_radius,
            clustering,
            coupling,
            stiffness,
            limits: Limits { force: f64::INFINITY, torque: f64::INFINITY },
            ..palpus::render::Settings::default()
        };
        Ok((Box::new(Engine(Renderer::new(a.clone(), b.clone(), settings)?, name)), note))
    };
    let predicted =
        PredictedSettings { contact, cluster_radius: scene.contact.cluster_radius, ..PredictedSettings::default() };
    let virtual_too = PredictedSettings { virtual_features: true, ..predicted };
    let most_change = Some(Change { force: 0.05, torque: 0.05 * 0.02 });
    let voxel = VoxelSettings { contact, ..VoxelSettings::default() };
    let shallow = VoxelSettings { beyond: Beyond::Nothing, ..voxel };
    let fine = VoxelSettings { voxel: Some(0.5e-3), ..voxel };
    let point = |settings, note| -> Result<Row, Box<dyn std::error::Error>> {
        Ok((Box::new(Voxel::new(a.clone(), b.clone(), settings)?), note))
    };
    let last = |settings, note| -> Result<Row, Box<dyn std::error::Error>> {
        Ok((Box::new(Predicted::new(a.clone(), b.clone(), settings)?), note))
    };
    let coupling = CouplingSettings::default();
    let same = virtual_coupling(&coupling, tolerance, a);
    let within = Voxel::new(a.clone(), b.clone(), voxel)?;
    let coupled = Coupled::new(within, a, contact.grip_a, coupling)?;
    Ok(vec![
        engine(Clustering::Smooth, None, "smooth", "")?,
        engine(Clustering::Linkage, None, "linkage", "")?,
        engine(Clustering::Smooth, Some(same), "smooth", "coupled")?,
        (Box::new(Epa::new(a.clone(), b.clone(), contact)?), ""),
        last(predicted, "")?,
        last(virtual_too, "virtual too")?,
        last(PredictedSettings { drawn_back: true, ..predicted }, "drawn back")?,
        last(PredictedSettings { most_change, ..predicted }, "50 mN/ms")?,
        point(voxel, "")?,
        point(shallow, "one layer")?,
        point(fine, "0.5 mm")?,
        point(VoxelSettings { full: 1, ..voxel }, "averaged")?,
        (Box::new(coupled), "coupled"),
    ])
}

/// Converts the baselines' coupling to a coupling of palpus, with the same critical damping.
fn virtual_coupling(settings: &CouplingSettings, tolerance: f64, a: &Body) -> VirtualCoupling {
    let CouplingSettings { mass, stiffness, angular_stiffness, damping_ratio } = *settings;
    // Inertia of the probe's mesh scaled to the mass.
    let inertia = a.mass().inertia * (mass / a.mass().volume);
    let moment = (inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z) / 3.0;
    VirtualCoupling {
        stiffness,
        damping: 2.0 * damping_ratio * (stiffness * mass).sqrt(),
        angular_stiffness,
        angular_damping: 2.0 * damping_ratio * (angular_stiffness * moment).sqrt(),
        contact_offset: tolerance,
        mass,
    }
}

/// Measures of one method along the path.
#[derive(Default)]
struct Figures {
    forces: Vec<f64>,
    torques: Vec<f64>,
    force_steps: Vec<f64>,
    torque_steps: Vec<f64>,
    springs: f64,
    /// Largest force step (N), and its time in the slow motion (s).
    when: (f64, f64),
    /// Changes of direction (rad), each with the smaller of the two forces (N).
    turns: Vec<(f64, f64)>,
    error: f64,
    truth: f64,
    /// Sum of the squared force.
    felt: f64,
    /// Sum of the product of force and true force.
    both: f64,
    inside: u32,
    lost: u32,
}

impl Figures {
    fn turn(&self) -> f64 {
        let least = 0.1 * mean(&self.forces);
        self.turns.iter().filter(|turn| turn.1 >= least).map(|turn| turn.0).fold(0.0, f64::max).to_degrees()
    }

    fn print(mut self, name: &str) {
        let [force_999, torque_999] =
            [&mut self.force_steps, &mut self.torque_steps].map(|steps| quantile(steps, 0.999).unwrap_or(0.0));
        let [force_max, torque_max] = [&self.force_steps, &self.torque_steps].map(|steps| most(steps));
        let percent = |share: f64| if self.truth > 0.0 { format!("{:.1} %", 100.0 * share) } else { "—".into() };
        let error = percent((self.error / self.truth).sqrt());
        let fitted = percent((1.0 - self.both * self.both / (self.felt * self.truth)).max(0.0).sqrt());
        println!(
            "| {name} | {:.2} | {:.1} | {:.1} | {:.1} % | {:.1} | {:.0} | {:.0} | {:.1} | {:.1} | {error} | {fitted} | {:.1} % | {:.3} |",
            mean(&self.forces),
            1e3 * mean(&self.torques),
            1e3 * force_max,
            100.0 * force_max / mean(&self.forces),
            1e3 * force_999,
            1e6 * torque_max,
            1e6 * torque_999,
            self.springs,
            self.turn(),
            100.0 * f64::from(self.lost) / f64::from(self.inside.max(1)),
            self.when.1,
        );
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn most(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// Returns the true force of a scene at a pose, if the scene has one, and whether the bodies
/// overlap. Without a true force, palpus determines the overlap.
fn truth(
    scene: &Scene,
    truth: Option<&Truth>,
    pose: &palpus::algebra::Pose,
    reference: &Felt,
) -> (Option<DVec3>, bool) {
    let Some(truth) = truth else { return (None, reference.deepest < 0.0) };
    let mut force = DVec3::ZERO;
    let mut inside = false;
    for contact in truth.contacts(pose) {
        force += contact.normal * (scene.contact.stiffness * (scene.contact.tolerance - contact.separation).max(0.0));
        inside |= contact.separation < 0.0;
    }
    (Some(force), inside)
}

fn measure(scene: &Scene) -> Result<(), Box<dyn std::error::Error>> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    let body = |soup| Body::from_soup(soup, &settings, &mut |_| ()).map(Arc::new);
    let (a, b) = (body(&scene.probe)?, body(&scene.environment)?);
    let mut methods = methods(&a, &b, scene)?;
    let law = Truth::of(scene);
    let reach = scene.probe.vertices.iter().map(|p| p.length()).fold(0.0, f64::max);
    let mut figures: Vec<Figures> = methods.iter().map(|_| Figures::default()).collect();
    let mut last: Vec<Wrench> = vec![Wrench::ZERO; methods.len()];
    let ticks = (scene.path.duration() * SLOWER / TICK) as u32;
    for tick in 0..ticks {
        let time = f64::from(tick) * TICK / SLOWER;
        let (pose, fast) = (scene.path.pose(time), scene.path.twist(time));
        let twist = Twist { angular: fast.angular / SLOWER, linear: fast.linear / SLOWER };
        let travel = (twist.linear.length() + twist.angular.length() * reach) * TICK;
        let mut reference = Felt::NOTHING;
        for (k, (method, _)) in methods.iter_mut().enumerate() {
            let felt = method.step(&pose, &twist, TICK);
            if k == 0 {
                reference = felt;
            }
            let (wrench, before) = (felt.wrench, std::mem::replace(&mut last[k], felt.wrench));
            let of = &mut figures[k];
            let (force, inside) = truth(scene, law.as_ref(), &pose, &reference);
            if let Some(force) = force {
                of.error += (wrench.force - force).length_squared();
                of.truth += force.length_squared();
                of.felt += wrench.force.length_squared();
                of.both += wrench.force.dot(force);
            }
            of.inside += u32::from(inside);
            of.lost += u32::from(inside && wrench.force == DVec3::ZERO);
            let step = (wrench.force - before.force).length();
            of.force_steps.push(step);
            if step > of.when.0 {
                of.when = (step, f64::from(tick) * TICK);
            }
            of.torque_steps.push((wrench.torque - before.torque).length());
            of.springs = of.springs.max(step / (scene.contact.stiffness * travel.max(SLOWEST * TICK)));
            let least = wrench.force.length().min(before.force.length());
            if least > 0.0 {
                of.turns.push((wrench.force.angle_between(before.force), least));
            }
            if wrench.force != DVec3::ZERO {
                of.forces.push(wrench.force.length());
                of.torques.push(wrench.torque.length());
            }
        }
    }
    println!("\n### {}\n", scene.name);
    println!(
        "| method | force N | torque mN·m | step mN | of mean | 99.9 % | torque step µN·m | 99.9 % | springs | turn ° | truth | fitted | lost | at s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (of, (method, note)) in figures.into_iter().zip(&methods) {
        of.print(format!("{} {note}", method.name()).trim());
    }
    Ok(())
}

/// Lowest speed for the column "springs", m/s. Near rest the ratio would have no meaning.
const SLOWEST: f64 = 1e-3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let named: Vec<String> = std::env::args().skip(1).collect();
    let usual = ["v-groove", "torus-torus", "box-table", "pen-sphere"].map(String::from);
    for name in if named.is_empty() { usual.as_slice() } else { named.as_slice() } {
        measure(&scene(name).ok_or_else(|| format!("there is no scene `{name}`"))?)?;
    }
    Ok(())
}
