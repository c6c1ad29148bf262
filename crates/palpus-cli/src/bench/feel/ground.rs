//! A scene prepared for measurement: bodies, script, the query for the overlap, and the pose in
//! which the probe is held at rest.

use std::sync::{Arc, OnceLock};

use anyhow::anyhow;
use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::Body;
use palpus::detect::{Contact, ContactQuery, QuerySettings};
use palpus::render::{ProbeState, Settings};
use palpus_baselines::{BaselineError, Voxel};
use palpus_device::SimulationSettings;
use palpus_io::scene::CouplingMode;
use palpus_scenes::refined::Refined;
use palpus_scenes::truth::{TrueContact, Truth};
use palpus_scenes::{HandPath, Scene};

use crate::bench::TICK;
use crate::bodies::Teller;
use crate::stage;

/// The scenes of the suite.
pub(super) const SCENES: [&str; 11] = [
    "pen-sphere",
    "v-groove",
    "box-tilt",
    "box-edge",
    "box-rest",
    "rails",
    "spoon-cup",
    "torus-torus",
    "peg-hole",
    "nut-bolt",
    "intestine",
];

/// A scene and the data that all methods on it share.
pub(super) struct Ground {
    pub(super) name: &'static str,
    pub(super) probe: Arc<Body>,
    pub(super) environment: Arc<Body>,
    /// Settings of the scene, for direct rendering.
    pub(super) settings: Settings,
    /// Settings for rendering behind a coupling that is tuned to the simulated device.
    pub(super) coupled: Settings,
    pub(super) path: HandPath,
    pub(super) truth: Option<Truth>,
    /// A refined truth, if it was requested.
    pub(super) refined: Option<RefinedTruth>,
    /// Distance from the grip to the farthest point of the probe, m.
    pub(super) reach: f64,
    /// Time on the path at which the script begins, s.
    pub(super) begin: f64,
    /// Poses of the probe at every millisecond of the script.
    pub(super) script: Vec<ProbeState>,
    /// Overlap of the bodies at every [`JUDGED`]th of these poses, m. Negative when apart, at least
    /// minus the tolerance.
    pub(super) depths: Vec<f64>,
    /// Direction and strength of a pressing hand at each of these times, in the environment's
    /// frame. Length 1 is a full press.
    pub(super) presses: Vec<DVec3>,
    pub(super) rest: Option<Rest>,
    /// Voxel maps, which are slow to make and are the same for every stiffness.
    pub(super) voxels: OnceLock<Result<Voxel, BaselineError>>,
}

/// The true contacts at one of the judged poses; `None` if the two searches disagree.
pub(super) type RefinedPose = Option<Vec<TrueContact>>;

/// A refined truth along the script.
pub(super) struct RefinedTruth {
    pub(super) law: Refined,
    /// Its contacts at every [`JUDGED`]th pose.
    pub(super) poses: Vec<RefinedPose>,
}

/// Number of ticks between two measurements of the overlap.
pub(super) const JUDGED: usize = 5;
/// Latest beginning of the script, as a share of the time that the script leaves out.
const LATER: f64 = 0.7;
/// Time in which the force of the hand's press rises, s.
const LEAN_IN: f64 = 0.3;
/// Time step of the search for a start pose without contact, s.
const SEARCH: f64 = 0.02;

/// A pose in which the probe is pressed against the environment and held.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    /// Pose of the probe in contact.
    pub(super) pose: Pose,
    /// Direction in which the hand presses, unit, in the environment's frame.
    pub(super) press: DVec3,
    /// True if the probe, pressed by its weight alone, stays in place without a hand.
    pub(super) stable: bool,
}

impl Ground {
    /// Prepares the scene called `name`, with at most `seconds` of its path.
    pub(super) fn new(name: &'static str, seconds: f64) -> anyhow::Result<Self> {
        let scene = palpus_scenes::scene(name).ok_or_else(|| anyhow!("there is no scene called {name}"))?;
        let ground = Self::unscripted(&scene)?;
        let path = ground.path.clone();
        let seconds = path.duration().min(seconds);
        let mut judge = ground.judge();
        let begin = begin(&path, &mut judge, LATER * (path.duration() - seconds));
        let grip = ground.settings.grip_a;
        let script: Vec<ProbeState> = (0..=(seconds / TICK).round() as usize)
            .map(|k| stage::scripted(&path, grip, begin + k as f64 * TICK))
            .collect();
        let judged: Vec<(Pose, Option<Contact>)> =
            script.iter().step_by(JUDGED).map(|probe| (probe.pose_ba, judge.deepest(&probe.pose_ba))).collect();
        let presses = presses(name, &judged);
        let nothing = -ground.settings.contact_tolerance;
        let depths = judged.iter().map(|(_, contact)| contact.map_or(nothing, |contact| -contact.separation)).collect();
        let rest = rest(name, &path, &judged);
        Ok(Self { truth: Truth::of(&scene), rest, begin, script, depths, presses, ..ground })
    }

    /// Returns the bodies, settings and path of `scene`, without its script and without measured
    /// overlaps.
    pub(super) fn unscripted(scene: &Scene) -> anyhow::Result<Self> {
        let mut stage = stage::of_built_in(scene, &Teller::Calls(&|_, _| ()))?;
        stage.coupling.mode = CouplingMode::Coupled;
        let coupled = stage.settings_for(&SimulationSettings::default().spec, 1.0 / TICK);
        let grip = stage.settings.grip_a;
        let reach = stage.probe.mesh().vertices().iter().map(|v| v.distance(grip)).fold(0.0, f64::max);
        Ok(Self {
            name: scene.name,
            truth: None,
            refined: None,
            reach,
            rest: None,
            begin: 0.0,
            coupled,
            voxels: OnceLock::new(),
            script: Vec::new(),
            depths: Vec::new(),
            presses: Vec::new(),
            probe: stage.probe,
            environment: stage.environment,
            settings: stage.settings,
            path: stage.path,
        })
    }

    /// Returns direction and strength of the hand's press `seconds` after the start of the script.
    pub(super) fn press(&self, seconds: f64) -> DVec3 {
        let place = (seconds / (JUDGED as f64 * TICK)).max(0.0);
        let at = |k: usize| self.presses.get(k).or(self.presses.last()).copied().unwrap_or_default();
        let k = place as usize;
        // If the hand starts in the middle of a path, the force of its press rises from zero.
        let s = (seconds / LEAN_IN).clamp(0.0, 1.0);
        at(k).lerp(at(k + 1), place - place.floor()) * (s * s * (3.0 - 2.0 * s))
    }

    /// Returns the refined truth of the script, in a scene that has one.
    pub(super) fn refined_truth(&self) -> Option<RefinedTruth> {
        let law = Refined::of(&palpus_scenes::scene(self.name)?)?;
        let reach = self.settings.contact_tolerance;
        let poses = self.script.iter().step_by(JUDGED).map(|probe| law.contacts(&probe.pose_ba, reach)).collect();
        Some(RefinedTruth { law, poses })
    }

    /// Returns the query that measures the overlap of the bodies.
    pub(super) fn judge(&self) -> Judge {
        Judge::new(&self.probe, &self.environment, self.settings.contact_tolerance)
    }
}

/// Returns the pose in which the scene's probe is held: the middle of its script, or the pose at
/// which the script presses deepest.
fn rest(name: &str, path: &HandPath, judged: &[(Pose, Option<Contact>)]) -> Option<Rest> {
    let down = |time: f64, stable| Some(Rest { pose: path.pose(time), press: -DVec3::Z, stable });
    match name {
        "pen-sphere" => down(path.duration() / 2.0, false),
        "v-groove" => down(1.2, true),
        "box-rest" => down(1.6, true),
        // The tip stands on the cup's floor.
        "spoon-cup" => down(path.duration() - 4.8, false),
        // The peg stands on the block, beside the hole.
        "peg-hole" => down(1.0, false),
        "box-tilt" | "box-edge" | "rails" => None,
        _ => {
            let (pose, contact) = judged
                .iter()
                .filter_map(|(pose, contact)| contact.map(|contact| (pose, contact)))
                .min_by(|a, b| a.1.separation.total_cmp(&b.1.separation))?;
            Some(Rest { pose: *pose, press: -contact.normal, stable: false })
        }
    }
}

/// Returns the last time before `latest` at which nothing touches, so that no energy is stored at
/// the start.
fn begin(path: &HandPath, judge: &mut Judge, latest: f64) -> f64 {
    let steps = (latest / SEARCH) as usize;
    let times = (0..=steps).rev().map(|k| k as f64 * SEARCH);
    times.into_iter().find(|time| judge.deepest(&path.pose(*time)).is_none()).unwrap_or(0.0)
}

/// Scenes in which the hand does not press beyond its script, because parts are assembled with as
/// little force as possible.
const UNPRESSED: [&str; 2] = ["peg-hole", "nut-bolt"];
/// Number of measurements on each side over which a press rises and falls: a tenth of a second.
const PRESS_BLUR: usize = 20;

/// Computes the directions in which a hand presses while its script overlaps: opposite to the
/// deepest contact's normal, smoothed.
fn presses(name: &str, judged: &[(Pose, Option<Contact>)]) -> Vec<DVec3> {
    let against = |(_, contact): &(Pose, Option<Contact>)| match contact {
        Some(contact) if contact.separation < 0.0 && !UNPRESSED.contains(&name) => -contact.normal,
        _ => DVec3::ZERO,
    };
    let mut presses: Vec<DVec3> = judged.iter().map(against).collect();
    // Smoothed twice, so that the press rises as smoothly as the press of a person's hand.
    for _ in 0..2 {
        presses = (0..presses.len())
            .map(|k| {
                let around = &presses[k.saturating_sub(PRESS_BLUR)..(k + PRESS_BLUR + 1).min(presses.len())];
                // Poses before and after the script count as poses without a press.
                around.iter().sum::<DVec3>() / (2 * PRESS_BLUR + 1) as f64
            })
            .collect();
    }
    presses
}

/// Measures the overlap of two bodies at a pose, in the same way for all methods: by the engine's
/// query without memory of earlier poses.
pub(super) struct Judge {
    query: ContactQuery,
}

impl Judge {
    fn new(a: &Arc<Body>, b: &Arc<Body>, tolerance: f64) -> Self {
        let settings = QuerySettings { tolerance, ..QuerySettings::default() };
        Self { query: ContactQuery::new(a.clone(), b.clone(), settings) }
    }

    /// Returns the deepest contact.
    pub(super) fn deepest(&mut self, pose_ba: &Pose) -> Option<Contact> {
        self.query.clear();
        self.query.contacts(pose_ba).iter().min_by(|a, b| a.separation.total_cmp(&b.separation)).copied()
    }

    /// Returns the overlap, m; negative when apart.
    pub(super) fn depth(&mut self, pose_ba: &Pose) -> f64 {
        self.deepest(pose_ba).map_or(-self.query.settings().tolerance, |contact| -contact.separation)
    }
}
