//! Tests that the device's pose, torque and twist refer to the grip, wherever the origin of the
//! probe's mesh is.

use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};
use palpus_device::{DeviceState, HapticDevice, SimulatedDevice, SimulationSettings, StepOutcome};
use palpus_io::scene::{CouplingMode, FilePolicy};

use crate::engine::{Detail, Engine};
use crate::stage::{self, Stage};

/// A temporary folder for one test, deleted on drop.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("palpus-grip-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("the folder can be created");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Writes a box with these corners as an OBJ file.
fn write_box(file: &Path, low: DVec3, high: DVec3) {
    let mut text = String::new();
    for k in 0..8u32 {
        let corner = DVec3::select(glam::BVec3::new(k & 1 != 0, k & 2 != 0, k & 4 != 0), high, low);
        text += &format!("v {} {} {}\n", corner.x, corner.y, corner.z);
    }
    text += "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
    std::fs::write(file, text).expect("the file can be written");
}

/// Corners of the bar in a frame with its origin at the centre of its tip, and the grip in this
/// frame (m).
const BAR: [DVec3; 2] = [DVec3::new(-0.005, -0.006, 0.0), DVec3::new(0.005, 0.006, 0.06)];
const HELD: DVec3 = DVec3::new(0.001, 0.002, 0.05);
/// Pose of the block below the bar, in the world.
const BLOCK: Pose =
    Pose { rotation: DQuat::from_xyzw(0.0, 0.0, 0.6, 0.8), translation: DVec3::new(0.005, -0.003, 0.002) };

/// Writes a scene with a bar above a block. The mesh of the bar is shifted by `shift` (m), and
/// `more` is appended to the probe's section.
fn bar_over_block(folder: &Folder, name: &str, shift: DVec3, more: &str) -> Stage {
    crate::bodies::use_cache(false);
    write_box(&folder.0.join(format!("{name}.obj")), BAR[0] + shift, BAR[1] + shift);
    write_box(&folder.0.join("block.obj"), DVec3::new(-0.03, -0.03, -0.02), DVec3::new(0.03, 0.03, 0.0));
    let (at, turned) = (BLOCK.translation.to_array(), BLOCK.rotation.to_array());
    let start = (DVec3::Z * 0.01 - shift).to_array();
    let text = format!(
        "unit = \"m\"\n[probe]\nmesh = \"{name}.obj\"\nposition = {start:?}\n{more}\n\
         [environment]\nmesh = \"block.obj\"\nposition = {at:?}\norientation = {turned:?}\n\
         [contact]\nfriction = {{ static = 0.4, dynamic = 0.3 }}\n"
    );
    let scene = folder.0.join(format!("{name}.toml"));
    std::fs::write(&scene, text).expect("the file can be written");
    stage::prepare(&scene.display().to_string(), FilePolicy::Inside).expect("the scene can be read")
}

/// Returns the wrenches on a hand that presses the bar onto the block by its grip and tilts it, for
/// two seconds.
fn pressed(stage: &Stage, mode: CouplingMode) -> Vec<Wrench> {
    let settings = SimulationSettings::default();
    let mut engine =
        Engine::new(stage, &[stage.settings_in(mode, &settings.spec, 1000.0)]).expect("the settings are valid");
    let intent = |time: f64| {
        let turn = std::f64::consts::PI * time;
        let height = 0.055 - 0.005 * (1.0 - turn.cos());
        let tilt = DQuat::from_rotation_y(0.2 * turn.sin()) * DQuat::from_rotation_x(0.1 * (2.0 * turn).sin());
        Pose { rotation: tilt, translation: HELD.with_z(height) }
    };
    let mut device = SimulatedDevice::new(settings, intent).expect("the settings are valid");
    (0..2000)
        .map(|_| {
            let [answer] = stepped(&mut engine, [device.read().expect("the device returns a state")]);
            let wrench = answer.wrench;
            device.write(&wrench).expect("the wrench is accepted");
            wrench
        })
        .collect()
}

#[test]
fn wrench_does_not_depend_on_mesh_origin() {
    let folder = Folder::new("origin");
    let shift = DVec3::new(0.24, -0.07, 0.11);
    let of = |name: &str, shift: DVec3| {
        bar_over_block(&folder, name, shift, &format!("grip = {:?}", (HELD + shift).to_array()))
    };
    let (tip, far) = (of("tip", DVec3::ZERO), of("far", shift));
    for mode in [CouplingMode::Coupled, CouplingMode::Direct] {
        let (tip, far) = (pressed(&tip, mode), pressed(&far, mode));
        let largest = |of: &dyn Fn(usize) -> f64| (0..tip.len()).map(of).fold(0.0, f64::max);
        let force = largest(&|k| tip[k].force.length());
        let torque = largest(&|k| tip[k].torque.length());
        assert!(force > 0.5 && torque > 1e-3, "{mode:?}: there must be contact: {force} N, {torque} N·m");
        let off = largest(&|k| tip[k].force.distance(far[k].force));
        let off_torque = largest(&|k| tip[k].torque.distance(far[k].torque));
        assert!(off < 1e-9 && off_torque < 1e-9, "{mode:?}: {off} N, {off_torque} N·m");
    }
}

/// Returns the engine's results for all devices.
fn stepped<const N: usize>(engine: &mut Engine, states: [DeviceState; N]) -> [StepOutcome<Detail>; N] {
    let mut answers = [const { None }; N];
    engine.step(&states, 1e-3, &mut answers);
    answers.map(|answer| answer.expect("each device gets a wrench"))
}

/// Returns the state of a device at rest.
fn still(pose: Pose) -> DeviceState {
    DeviceState { pose, twist: Twist::default(), buttons: 0, time: 0.0, withheld: false }
}

/// Returns the pose after a rotation of the wrist by 10° about the device's own origin. The axis is
/// chosen so that a lever arm would be visible.
fn turned(pose: Pose) -> Pose {
    Pose { rotation: DQuat::from_rotation_z(10f64.to_radians()) * pose.rotation, ..pose }
}

/// 240 mm from a part to the origin of its assembly, m.
const ASSEMBLY: DVec3 = DVec3::new(0.24, 0.0, 0.0);

#[test]
fn wrist_turn_leaves_far_automatic_grip_in_place() {
    let folder = Folder::new("automatic");
    let stage = bar_over_block(&folder, "part", ASSEMBLY, "");
    let grip_a = stage.settings.grip_a;
    assert!(grip_a.distance(stage.probe.mass().center_of_mass) < 1e-12, "{grip_a}");
    let mut engine = Engine::new(&stage, &[stage.settings]).expect("the settings are valid");
    let start = stage.intent()(0.0);
    assert_eq!(start, stage.grip(stage.path.pose(0.0)));
    let [before] = stepped(&mut engine, [still(start)]).map(|answer| answer.detail.tool);
    let [after] = stepped(&mut engine, [still(turned(start))]).map(|answer| answer.detail.tool);
    assert!(before.translation.distance(stage.path.pose(0.0).translation) < 1e-12);
    let moved = before.point(grip_a).distance(after.point(grip_a));
    assert!(moved < 1e-12, "the grip moved by {moved} m");
    let origin = before.translation.distance(after.translation);
    assert!((origin - 0.0418).abs() < 1e-3, "the mesh's origin moves by {origin} m");
}

#[test]
fn both_tools_rotate_about_their_grips() {
    let folder = Folder::new("both");
    write_box(&folder.0.join("other.obj"), BAR[0] - ASSEMBLY, BAR[1] - ASSEMBLY);
    let second = "[second]\nmesh = \"other.obj\"\nposition = [0.3, 0, 0.05]";
    let stage = bar_over_block(&folder, "part", ASSEMBLY, second);
    let other = stage.of_others().next().expect("the scene has a second tool");
    let stages = [&stage, &other];
    for stage in stages {
        assert!(stage.settings.grip_a.distance(stage.probe.mass().center_of_mass) < 1e-12);
    }
    let mut engine = Engine::new(&stage, &stages.map(|stage| stage.settings)).expect("the settings are valid");
    let starts = stages.map(|stage| stage.intent()(0.0));
    let before = stepped(&mut engine, starts.map(still)).map(|answer| answer.detail.tool);
    let after = stepped(&mut engine, starts.map(turned).map(still)).map(|answer| answer.detail.tool);
    for k in 0..2 {
        let grip_a = stages[k].settings.grip_a;
        assert!(before[k].translation.distance(stages[k].path.pose(0.0).translation) < 1e-12, "tool {k}");
        assert!(before[k].point(grip_a).distance(after[k].point(grip_a)) < 1e-12, "tool {k}");
    }
}
