//! Tests of sessions whose settings are changed during the run.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Parser;
use palpus::algebra::Pose;
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::Settings;
use palpus_device::{AfterPanic, Cut, Cuts, Guide};
use palpus_io::read_recording;
use palpus_io::scene::FilePolicy;

use super::session_device::EndedDevice;
use super::{Beginning, Ended, Ready, Session};
use crate::args::RunArguments;
use crate::divergence::Report;
use crate::rerun::Rerun;
use crate::rerun::places::Places;
use crate::{safety, stage};

/// A temporary folder for one test, deleted on drop.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("palpus-session-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("the folder can be created");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Starts a session on `scene` in simulated time, paused before its first tick.
fn paused(scene: &str, record: Option<PathBuf>) -> Session {
    crate::bodies::use_cache(false);
    let arguments = RunArguments::parse_from(["run", scene, "--fast"]);
    let stage = stage::prepare(scene, FilePolicy::Inside).expect("the scene is built in");
    let ready = Ready::new(&arguments, scene, stage, true).expect("the run can be prepared");
    let beginning = Beginning { record: record.as_deref(), paused: true, ..Beginning::default() };
    Session::start(ready, &beginning, &Arc::new(AtomicBool::new(false))).expect("the session starts")
}

/// Timeout. It is long, since the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(60);

/// Continues the session to the end of tick `ticks`.
fn run_to(session: &mut Session, ticks: u64) {
    let made = session.live().ticks;
    session.control().step(ticks - made);
    let begin = Instant::now();
    while session.live().ticks < ticks {
        assert!(begin.elapsed() < PATIENCE, "the loop does not continue");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Replays `file`. Returns the number of equal wrenches, and of all wrenches.
fn replayed(file: &std::path::Path) -> anyhow::Result<(usize, usize)> {
    let recording = read_recording(file)?;
    let mut same = 0;
    let (_, mut again) = Rerun::new(&recording, &Places::of(file, FilePolicy::Inside))?;
    again.run(&mut |k, wrench| {
        same += usize::from(recording.rows[k].same_wrench(wrench));
        ControlFlow::Continue(())
    })?;
    Ok((same, recording.rows.len()))
}

const SHADING: ShadingSettings = ShadingSettings { crease_angle: 0.3, most_turn: 0.7 };
const FRICTION: FrictionSettings =
    FrictionSettings { static_coefficient: 0.6, dynamic_coefficient: 0.5, tangential_stiffness: 900.0 };

#[test]
fn changed_settings_replay_bit_for_bit_without_allocating() {
    let folder = Folder::new("changes");
    let file = folder.0.join("run.csv");
    let mut session = paused("spoon-cup", Some(file.clone()));
    let [(_, usual), (_, paper)] = session.presets();
    assert_eq!(*session.settings(), usual);
    let shading = (session.settings().shading.is_none()).then_some(SHADING);
    for (k, change) in [
        Settings { friction: Some(FRICTION), ..usual },
        Settings { shading, ..usual },
        paper,
        Settings { stiffness: 1200.0, contact_tolerance: 2e-3, ..paper },
        Settings { friction: None, shading: None, patch_angle: None, ..usual },
        usual,
    ]
    .iter()
    .enumerate()
    {
        run_to(&mut session, 400 * (k as u64 + 1));
        session.set_settings(change).expect("the settings are valid");
        if k == 2 {
            let at = Pose { translation: session.stage().path.pose(0.0).translation, ..Pose::IDENTITY };
            assert!(session.can_guide());
            session.guide(Guide::Held(at));
        }
    }
    run_to(&mut session, 3000);
    let Ended { devices, notes, .. } = session.end().expect("the session ends");
    let [EndedDevice { summary, recordings, .. }] = &devices[..] else { panic!("the run must have one device") };
    assert_eq!(summary.ticks, 3000);
    assert_eq!(summary.allocations, 0, "the loop must not allocate");
    assert_eq!(*recordings, std::slice::from_ref(&file));
    assert!(notes.is_empty(), "{notes:?}");
    let recording = read_recording(&file).expect("the recording can be read");
    let ticks: Vec<u64> = recording.changes.iter().map(|change| change.0).collect();
    assert_eq!(ticks, [400, 800, 1200, 1600, 2000, 2400]);
    for tick in ticks.into_iter().map(|tick| tick as usize) {
        let [before, after] = [tick - 1, tick].map(|tick| &recording.rows[tick]);
        assert!(Cuts::from_bits(after.faults).has(Cut::Settings));
        let step = after.wrench.force.distance(before.wrench.force);
        assert!(step < 0.1, "the force changes by {step} N in the tick of the new settings, {tick}");
    }
    assert_eq!(replayed(&file).expect("the recording can be replayed"), (3000, 3000));
}

#[test]
fn run_that_continues_after_a_panic_replays_bit_for_bit() {
    let folder = Folder::new("panic");
    let file = folder.0.join("run.csv");
    crate::bodies::use_cache(false);
    let arguments = RunArguments::parse_from(["run", "box-table", "--fast", "--duration", "3", "--fault", "panic@1.5"]);
    let stage = stage::prepare("box-table", FilePolicy::Inside).expect("the scene is built in");
    let mut ready = Ready::new(&arguments, "box-table", stage, false).expect("the run can be prepared");
    let plan = &mut ready.plans[0];
    plan.options.safety.after_panic = AfterPanic::AsFault;
    safety::recorded(&plan.limits, plan.enable_mode, &plan.options.safety, &mut plan.header.scene.more);
    let beginning = Beginning { record: Some(&file), ..Beginning::default() };
    let session = Session::start(ready, &beginning, &Arc::new(AtomicBool::new(false))).expect("the session starts");
    let Ended { devices, notes, .. } = session.wait().expect("the session ends");
    assert_eq!((devices[0].summary.ticks, notes), (3000, Vec::new()));
    let rows = read_recording(&file).expect("the recording can be read").rows;
    let not_stepped: Vec<u64> =
        rows.iter().filter(|row| !row.servo.expect("the row has format 3").stepped).map(|row| row.tick).collect();
    assert_eq!(not_stepped, [1500]);
    assert!(rows.iter().any(|row| row.tick > 2000 && row.wrench.force.length() > 0.1), "there must be a force again");
    assert_eq!(replayed(&file).expect("the recording can be replayed"), (3000, 3000));
}

#[test]
fn invalid_settings_are_refused_and_run_continues() {
    let mut session = paused("pen-sphere", None);
    let usual = *session.settings();
    assert!(session.set_settings(&Settings { stiffness: -1.0, ..usual }).is_err());
    assert_eq!(*session.settings(), usual);
    // Settings that the engine's state or the device determines do not change.
    let other = Settings { capacity: 7, limits: palpus::render::Limits { force: 1e3, torque: 1e3 }, ..usual };
    session.set_settings(&other).expect("the other settings are valid");
    assert_eq!(*session.settings(), usual);
    run_to(&mut session, 100);
    assert_eq!(session.end().expect("the session ends").devices[0].summary.ticks, 100);
}

#[test]
fn recordings_start_and_stop_and_overwrite_nothing() {
    let folder = Folder::new("recordings");
    let file = folder.0.join("run.csv");
    let mut session = paused("pen-sphere", Some(file.clone()));
    run_to(&mut session, 200);
    assert_eq!(session.recording(), Some(file.as_path()));
    assert_eq!(session.stop_recording().expect("the recording ends"), Some(file.clone()));
    run_to(&mut session, 300);
    assert_eq!(session.recording(), None);
    let stiffer = Settings { stiffness: 3000.0, ..*session.settings() };
    session.set_settings(&stiffer).expect("the settings are valid");
    let second = session.record(&file).expect("the recording starts");
    assert_eq!(second, folder.0.join("run-2.csv"));
    run_to(&mut session, 500);
    session.set_settings(&Settings { stiffness: 2000.0, ..stiffer }).expect("the settings are valid");
    run_to(&mut session, 600);
    let third = session.record(&file).expect("the recording starts");
    assert_eq!(third, folder.0.join("run-3.csv"));
    run_to(&mut session, 700);
    let ended = session.end().expect("the session ends");
    assert_eq!(ended.devices[0].recordings, [file.clone(), second.clone(), third.clone()]);

    let ticks = |file| {
        let recording = read_recording(file).expect("the recording can be read");
        let ends = [recording.rows.first(), recording.rows.last()].map(|row| row.expect("the recording has rows").tick);
        (ends, recording.header.scene.render.stiffness, recording.changes.len())
    };
    let usual = read_recording(&file).expect("the recording can be read").header.scene.render.stiffness;
    assert_eq!(ticks(&file), ([0, 199], usual, 0));
    assert_eq!(ticks(&second), ([300, 599], 3000.0, 1));
    assert_eq!(ticks(&third), ([600, 699], 2000.0, 0));
    assert_eq!(replayed(&file).expect("a recording from the start can be replayed"), (200, 200));
    let refused = replayed(&second).expect_err("a later recording cannot be replayed").to_string();
    assert!(refused.contains("tick 300") && refused.contains("during a run"), "{refused}");
}

#[test]
fn guided_probe_with_a_far_grip_goes_to_held_pose() {
    let folder = Folder::new("far-grip");
    let file = folder.0.join("run.csv");
    let box_at = |low: f64| {
        let corner = |k: u32| [low + 0.02 * f64::from(k & 1), 0.02 * f64::from(k >> 1 & 1), 0.02 * f64::from(k >> 2)];
        let corners: String = (0..8).map(corner).map(|at| format!("v {} {} {}\n", at[0], at[1], at[2])).collect();
        corners + "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n"
    };
    std::fs::write(folder.0.join("far.obj"), box_at(0.24)).expect("the file can be written");
    std::fs::write(folder.0.join("near.obj"), box_at(0.0)).expect("the file can be written");
    let scene = folder.0.join("scene.toml");
    let text =
        "unit = \"m\"\n[probe]\nmesh = \"far.obj\"\nposition = [0, 0, 0.1]\n[environment]\nmesh = \"near.obj\"\n";
    std::fs::write(&scene, text).expect("the file can be written");
    let mut session = paused(&scene.display().to_string(), Some(file.clone()));
    let (grip_a, start) = (session.settings().grip_a, session.stage().path.pose(0.0));
    assert!(grip_a.x > 0.2, "{grip_a}");
    run_to(&mut session, 100);
    // The probe is rotated about its grip and lifted.
    let rotation = glam::DQuat::from_rotation_z(0.4);
    let goal = Pose { rotation, ..start.with_origin(grip_a) }.with_origin(-grip_a);
    let goal = Pose { translation: goal.translation + glam::DVec3::Z * 0.02, ..goal };
    session.guide(Guide::Held(goal));
    run_to(&mut session, 1600);
    session.end().expect("the session ends");
    let recording = read_recording(&file).expect("the recording can be read");
    let tool = recording.rows.last().and_then(|row| row.tool).expect("the row has a tool pose");
    let off = tool.point(grip_a).distance(goal.point(grip_a));
    let turned = palpus::algebra::rotation_between(tool.rotation, goal.rotation).length();
    assert!(off < 2e-3 && turned < 0.1, "{off} m, {turned} rad");
}

#[test]
fn two_tools_are_steered_recorded_and_replayed() {
    let folder = Folder::new("two-tools");
    let file = folder.0.join("run.csv");
    let mut session = paused("two-hands", Some(file.clone()));
    let [(_, usual), (_, paper)] = session.presets();
    run_to(&mut session, 700);
    let at = Pose { translation: session.stage().path.pose(0.3).translation, ..Pose::IDENTITY };
    assert!(session.can_guide());
    session.guide(Guide::Held(at));
    session
        .set_settings(&Settings { friction: Some(FRICTION), shading: Some(SHADING), ..paper })
        .expect("the settings are valid");
    run_to(&mut session, 1500);
    session.set_settings(&usual).expect("the settings are valid");
    run_to(&mut session, 2500);
    // No file may be overwritten, neither the first tool's nor the second tool's.
    std::fs::write(folder.0.join("run-2-second.csv"), "mine").expect("the file can be written");
    let later = session.record(&file).expect("the recordings start");
    assert_eq!(later, folder.0.join("run-3.csv"));
    run_to(&mut session, 2600);
    let Ended { devices, notes, .. } = session.end().expect("the session ends");
    let [first, second] = &devices[..] else { panic!("the run must have two tools") };
    assert_eq!((first.summary.ticks, second.summary.ticks), (2600, 2600));
    assert_eq!((first.summary.allocations, second.summary.allocations), (0, 0), "the loop must not allocate");
    assert!(notes.is_empty(), "{notes:?}");
    assert_eq!(first.recordings, [file.clone(), later.clone()]);
    assert_eq!(second.recordings, ["run-second.csv", "run-3-second.csv"].map(|name| folder.0.join(name)));
    let changed = |path: &PathBuf| -> Vec<u64> {
        read_recording(path).expect("the recording can be read").changes.iter().map(|change| change.0).collect()
    };
    assert_eq!((changed(&file), changed(&second.recordings[0])), (vec![700, 1500], vec![700, 1500]));
    for path in [&file, &second.recordings[0]] {
        let recording = read_recording(path).expect("the recording can be read");
        let (_, again) =
            Rerun::new(&recording, &Places::of(path, FilePolicy::Inside)).expect("the recording can be replayed");
        let reports = again.compare().expect("the recording can be replayed");
        assert!(reports.len() == 2 && reports.iter().all(Report::is_identical), "{}", path.display());
    }
    let late = read_recording(&later).expect("the recording can be read");
    let error =
        Rerun::new(&late, &Places::of(&later, FilePolicy::Inside)).err().expect("a later recording cannot be replayed");
    assert!(error.to_string().contains("during a run"), "{error}");
}
