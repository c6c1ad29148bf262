//! The measured methods behind one interface: the probe's state in, the wrench on the hand out.

use std::sync::Arc;

use palpus::algebra::{NoClock, Pose, Twist, Wrench};
use palpus::body::Body;
use palpus::render::{Clustering, Limits, ProbeState, Renderer, Settings, Tick};
use palpus_baselines::{
    Baseline, Coupled, CouplingSettings, Epa, Felt, Predicted, PredictedSettings, Voxel, VoxelSettings,
};

use super::ground::Ground;
use crate::bench::TICK;

/// Result of a method in one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeltTick {
    /// Wrench on the probe about its grip, in the environment's frame.
    pub(super) wrench: Wrench,
    /// Separation of the deepest contact according to the method, m; infinite without contacts.
    pub(super) separation: f64,
    /// Pose at which the method shows the probe.
    pub(super) shown: Pose,
}

/// A rendering method with its state.
pub(super) trait Method {
    /// Computes one step.
    fn step(&mut self, probe: &ProbeState, dt: f64) -> FeltTick;

    /// Returns the result after the probe has been held at the pose of the last step until nothing
    /// moves; `None` for methods that are not measured at rest.
    fn at_rest(&self, _probe: &ProbeState) -> Option<FeltTick> {
        None
    }
}

/// Number of steps for which the probe is held still: ten times the decay time of the coupling's
/// damper.
const STILL: usize = 30;

/// Parameters of a method in addition to the scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tuning {
    /// Contact stiffness, N/m; `None` for the scene's stiffness, or behind the coupling for the
    /// stiffness that the device allows.
    pub(super) stiffness: Option<f64>,
    /// Contact damping, N·s/m.
    pub(super) damping: f64,
    /// True for friction as in the scene, false for no friction.
    pub(super) friction: bool,
    /// Limits of the wrench.
    pub(super) limits: Limits,
}

impl Tuning {
    /// Returns the scene's own parameters, without a device's limits.
    pub(super) fn of(ground: &Ground) -> Self {
        Self {
            stiffness: None,
            damping: ground.settings.damping,
            friction: true,
            limits: Limits { force: f64::INFINITY, torque: f64::INFINITY },
        }
    }
}

/// Separation at which a method begins to push.
#[derive(Clone, Copy)]
pub(super) enum ContactOffset {
    /// The force begins at the contact tolerance.
    Tolerance,
    /// The force begins at the tool's contact offset.
    Tool,
    /// The force begins where the surfaces touch.
    Surface,
}

impl ContactOffset {
    /// Returns the separation at which the force begins (m).
    pub(super) fn width(self, ground: &Ground) -> f64 {
        match self {
            Self::Tolerance => ground.settings.contact_tolerance,
            Self::Tool => ground.coupled.contact_offset(),
            Self::Surface => 0.0,
        }
    }
}

/// A method by name.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    pub(super) name: &'static str,
    pub(super) summary: &'static str,
    pub(super) contact_offset: ContactOffset,
    /// True if its contacts have dampers.
    pub(super) has_damping: bool,
    /// True if generated energy is damped away at once (`--passive`). In the open loop the method
    /// cannot change the motion, so this has no effect there.
    pub(super) is_passive: bool,
    /// True if the method's steps are too slow for runs with every hand.
    pub(super) is_costly: bool,
    build: fn(&Ground, &Tuning) -> anyhow::Result<Box<dyn Method>>,
}

impl Entry {
    /// Creates the method for the scene.
    pub(super) fn build(&self, ground: &Ground, tuning: &Tuning) -> anyhow::Result<Box<dyn Method>> {
        (self.build)(ground, tuning)
    }
}

/// A method without properties of its own.
const PLAIN: Entry = Entry {
    name: "",
    summary: "",
    contact_offset: ContactOffset::Tolerance,
    has_damping: false,
    is_passive: false,
    is_costly: false,
    build: |ground, tuning| rendered(&ground.settings, Clustering::Smooth, ground, tuning),
};

/// All methods, in the order of the tables.
pub(super) const METHODS: [Entry; 10] = [
    Entry {
        name: "paper",
        summary: "exact linkage, direct rendering: the paper's method",
        has_damping: true,
        build: |ground, tuning| rendered(&ground.settings, Clustering::Linkage, ground, tuning),
        ..PLAIN
    },
    Entry {
        name: "smooth",
        summary: "smooth clustering, direct rendering",
        has_damping: true,
        build: |ground, tuning| rendered(&ground.settings, Clustering::Smooth, ground, tuning),
        ..PLAIN
    },
    Entry {
        name: "coupled",
        summary: "exact linkage behind the virtual coupling, tuned to the device",
        contact_offset: ContactOffset::Tool,
        has_damping: true,
        build: |ground, tuning| rendered(&ground.coupled, Clustering::Linkage, ground, tuning),
        ..PLAIN
    },
    Entry {
        name: "coupled-smooth",
        summary: "smooth clustering behind the same coupling",
        contact_offset: ContactOffset::Tool,
        has_damping: true,
        build: |ground, tuning| rendered(&ground.coupled, Clustering::Smooth, ground, tuning),
        ..PLAIN
    },
    Entry {
        name: "smooth-passive",
        summary: "smooth, with passivity",
        is_passive: true,
        build: |ground, tuning| rendered(&ground.settings, Clustering::Smooth, ground, tuning),
        ..PLAIN
    },
    Entry {
        name: "coupled-passive",
        summary: "coupled-smooth, with passivity",
        contact_offset: ContactOffset::Tool,
        is_passive: true,
        build: |ground, tuning| rendered(&ground.coupled, Clustering::Smooth, ground, tuning),
        ..PLAIN
    },
    Entry {
        name: "predicted",
        summary: "depth predicted along the motion from the last closest features (the paper's [16])",
        build: |ground, tuning| {
            let (a, b) = ground.bodies();
            let cluster_radius = ground.settings.cluster_radius;
            let settings = PredictedSettings { contact: contact(ground, tuning), cluster_radius, ..Default::default() };
            Ok(Box::new(OtherMethod(Predicted::new(a, b, settings)?)))
        },
        ..PLAIN
    },
    Entry {
        name: "voxel",
        summary: "a point shell in a voxel map (the paper's [30])",
        is_costly: true,
        build: |ground, tuning| Ok(Box::new(OtherMethod(ScaledVoxelMap::new(ground, tuning)?))),
        ..PLAIN
    },
    Entry {
        name: "voxel-coupled",
        summary: "the same behind an explicit virtual coupling, as in its paper",
        is_costly: true,
        build: |ground, tuning| {
            let within = ScaledVoxelMap::new(ground, tuning)?;
            let method = Coupled::new(within, &ground.probe, ground.settings.grip_a, CouplingSettings::default())?;
            Ok(Box::new(OtherMethod(method)))
        },
        ..PLAIN
    },
    Entry {
        name: "epa",
        summary: "one contact of the expanding polytope algorithm for each pair of pieces, as with Coal",
        build: |ground, tuning| {
            let (a, b) = ground.bodies();
            Ok(Box::new(OtherMethod(Epa::new(a, b, contact(ground, tuning))?)))
        },
        ..PLAIN
    },
];

fn contact(ground: &Ground, tuning: &Tuning) -> palpus_baselines::Settings {
    let Settings { contact_tolerance: tolerance, grip_a, stiffness, .. } = ground.settings;
    palpus_baselines::Settings { tolerance, stiffness: tuning.stiffness.unwrap_or(stiffness), grip_a }
}

fn rendered(
    base: &Settings,
    clustering: Clustering,
    ground: &Ground,
    tuning: &Tuning,
) -> anyhow::Result<Box<dyn Method>> {
    let (a, b) = ground.bodies();
    let stiffness = tuning.stiffness.unwrap_or(base.stiffness);
    let friction = base.friction.filter(|_| tuning.friction).map(|mut friction| {
        // The tangential stiffness equals the normal stiffness.
        friction.tangential_stiffness *= stiffness / base.stiffness;
        friction
    });
    let Tuning { damping, limits, .. } = *tuning;
    let settings = Settings { clustering, stiffness, damping, friction, limits, ..*base };
    Ok(Box::new(Rendered(Renderer::new(a, b, settings)?)))
}

/// palpus's own renderer.
struct Rendered(Renderer);

impl Method for Rendered {
    fn step(&mut self, probe: &ProbeState, dt: f64) -> FeltTick {
        felt(self.0.step(probe, dt, &NoClock))
    }

    fn at_rest(&self, probe: &ProbeState) -> Option<FeltTick> {
        let held = ProbeState { twist: Twist::default(), ..*probe };
        let mut renderer = self.0.clone();
        (0..STILL).for_each(|_| _ = renderer.step(&held, TICK, &NoClock));
        Some(felt(renderer.tick()))
    }
}

fn felt(tick: &Tick) -> FeltTick {
    FeltTick { wrench: tick.commanded, separation: tick.separation(), shown: tick.tool_ba }
}

/// A method of other authors.
struct OtherMethod<B>(B);

impl<B: Baseline> Method for OtherMethod<B> {
    fn step(&mut self, probe: &ProbeState, dt: f64) -> FeltTick {
        let Felt { wrench, deepest, .. } = self.0.step(&probe.pose_ba, &probe.twist, dt);
        FeltTick { wrench, separation: deepest, shown: probe.pose_ba }
    }
}

/// Scales the voxel map to another stiffness. Making the map is slow, and its forces are linear in
/// the stiffness.
struct ScaledVoxelMap {
    voxels: Voxel,
    factor: f64,
}

impl ScaledVoxelMap {
    fn new(ground: &Ground, tuning: &Tuning) -> anyhow::Result<Self> {
        let made_for = ground.settings.stiffness;
        Ok(Self { voxels: ground.voxels()?, factor: tuning.stiffness.unwrap_or(made_for) / made_for })
    }
}

impl Baseline for ScaledVoxelMap {
    fn name(&self) -> &'static str {
        self.voxels.name()
    }

    fn step(&mut self, pose_ba: &Pose, twist: &Twist, dt: f64) -> Felt {
        let felt = self.voxels.step(pose_ba, twist, dt);
        let Wrench { torque, force } = felt.wrench;
        Felt { wrench: Wrench { torque: torque * self.factor, force: force * self.factor }, ..felt }
    }

    fn clear(&mut self) {
        self.voxels.clear();
    }
}

impl Ground {
    fn bodies(&self) -> (Arc<Body>, Arc<Body>) {
        (self.probe.clone(), self.environment.clone())
    }

    /// Returns the voxel map of the environment, made once.
    fn voxels(&self) -> anyhow::Result<Voxel> {
        let made = self.voxels.get_or_init(|| {
            let (a, b) = self.bodies();
            let settings = VoxelSettings { contact: contact(self, &Tuning::of(self)), ..Default::default() };
            Voxel::new(a, b, settings)
        });
        Ok(made.clone()?)
    }
}
