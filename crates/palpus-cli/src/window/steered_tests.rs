//! Requests of a window, tested without a window.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Parser;
use glam::DVec3;
use palpus::algebra::Pose;
use palpus::render::Settings;
use palpus_device::Guide;
use palpus_io::read_recording;
use palpus_io::scene::FilePolicy;
use palpus_window::{Cap, Loading, MeshFile, Run, Start, Wanted};

use super::here::begin;
use super::recent::Recent;
use super::steered::Steered;
use crate::args::RunArguments;
use crate::run::{self, Ready};
use crate::stage;

/// The timeout is long because the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(120);

/// Polls once a frame until `done`.
fn until(run: &mut Steered<'_>, done: impl Fn(&mut Steered<'_>) -> bool) {
    let begin = Instant::now();
    while !done(run) {
        assert!(begin.elapsed() < PATIENCE, "it does not come: {:?}", run.loading());
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn with_run(name: &str, test: impl FnOnce(Steered<'_>, &Path)) {
    crate::bodies::use_cache(false);
    let folder: PathBuf = std::env::temp_dir().join(format!("palpus-steered-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    let record = folder.join("run.csv").display().to_string();
    let arguments = RunArguments::parse_from(["run", "pen-sphere", "--no-realtime", "--record", &record]);
    let stop = Arc::new(AtomicBool::new(false));
    let stage = stage::prepare("pen-sphere", FilePolicy::Inside).expect("a built-in scene");
    let ready = Ready::new(&arguments, "pen-sphere", stage, true).expect("a plan and an engine");
    let (session, scene, _) = begin(ready, &run::beginning(&arguments), &stop).expect("a session");
    assert_eq!(scene.bodies.len(), 2);
    let recent = Recent::kept_in(Some(folder.join("recent.txt")));
    test(Steered::new(&arguments, session, recent, &stop), &folder);
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn a_run_is_steered_and_followed_by_another_scene_and_by_a_dropped_mesh() {
    with_run("followed", |mut run, folder| {
        until(&mut run, |run| run.numbers().ticks > 20);
        assert!(run.can_guide() && !run.is_over() && !run.closes_when_over());
        assert!(matches!(run.cap(), Cap::None | Cap::Unusable(_)));
        run.guide(Guide::Held(Pose::IDENTITY));
        let paper = run.presets()[1].settings;
        run.set_settings(&paper).expect("it can be");
        assert_eq!(run.settings(), paper);
        assert!(run.set_settings(&Settings { stiffness: f64::NAN, ..paper }).is_err());
        run.pause(true).expect("it can be paused");
        assert!(run.is_paused());
        run.pause(false).expect("it goes on");

        // A scene that cannot be prepared gives one line, and the run goes on.
        let nowhere = Wanted::SceneFile(folder.join("nowhere.toml"));
        run.load(nowhere).expect("it begins");
        until(&mut run, |run| matches!(run.loading(), Loading::Failed(_)));
        let Loading::Failed(why) = run.loading() else { unreachable!() };
        assert!(why.contains("nowhere.toml") && !why.contains('\n'), "{why}");
        assert!(run.replaced().is_none() && !run.is_over());

        run.load(Wanted::Scene("box-table".to_owned())).expect("it begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        let (scene, _) = run.replaced().expect("another scene");
        assert!(scene.title == "box-table" && run.replaced().is_none());
        assert_eq!(run.recording(), Some(folder.join("run-2.csv")));
        until(&mut run, |run| run.numbers().ticks > 20);

        let cube = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
            f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
        let file = folder.join("cube.obj");
        std::fs::write(&file, cube).expect("a file");
        let probe = Some(MeshFile { file, metres_per_unit: 0.01 });
        run.load(Wanted::Meshes { probe, environment: None }).expect("it begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        until(&mut run, |run| run.numbers().ticks > 20);
        assert!(run.replaced().is_some() && run.record(false).is_ok() && run.recording().is_none());
        assert!(run.record(false).is_err(), "nothing is recorded any more");

        let opened = run.recent();
        assert_eq!(opened.len(), 1);
        assert!(opened[0].ends_with("cube.obj"), "{opened:?}");

        let ended = run.end().expect("it ends");
        assert_eq!(ended.len(), 3);
        for run in &ended {
            let recording = read_recording(&run.seats[0].recordings[0]).expect("a recording");
            assert!(!recording.rows.is_empty() && recording.rows[0].tick == 0, "{}", run.name);
        }
        assert!(folder.join("scenes/cube/scene.toml").is_file());
        assert_eq!(read_recording(&folder.join("run.csv")).expect("a recording").changes.len(), 1);
    });
}

#[test]
fn the_scene_begins_anew_where_it_is_told_and_is_saved() {
    with_run("anew", |mut run, folder| {
        until(&mut run, |run| run.numbers().ticks > 20);
        let start = Start {
            probe: Some(Pose::from_translation(DVec3::new(0.01, 0.02, 0.3))),
            grip_a: Some(DVec3::new(0.0, 0.0, 0.004)),
            lead_out: false,
        };
        run.restart(Some(start)).expect("it begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        let (scene, _) = run.replaced().expect("the same scene");
        assert_eq!(Some(scene.bodies[0].pose), start.probe);
        assert_eq!(Some(run.settings().grip_a), start.grip_a);
        let wanted = Settings { stiffness: 1234.0, ..run.settings() };
        run.set_settings(&wanted).expect("it can be");
        let file = run.save().expect("it is saved");
        assert!(file.starts_with(folder.join("scenes")), "{}", file.display());
        assert_eq!(run.recent(), std::slice::from_ref(&file));

        // Restarts the original scene, then loads the saved one.
        run.restart(None).expect("it begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        let (scene, _) = run.replaced().expect("the same scene");
        assert!(Some(scene.bodies[0].pose) != start.probe && Some(run.settings().grip_a) != start.grip_a);
        run.load(Wanted::SceneFile(file)).expect("it begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        let (scene, _) = run.replaced().expect("what was saved");
        let probe = scene.bodies[0].pose.translation;
        assert!((probe - DVec3::new(0.01, 0.02, 0.3)).length() < 1e-9, "{probe}");
        assert!((run.settings().stiffness - 1234.0).abs() < 1e-6);
    });
}

#[test]
fn a_probe_inside_is_led_out_on_request() {
    with_run("led-out", |mut run, folder| {
        until(&mut run, |run| run.numbers().ticks > 20);
        let inside = Pose::from_translation(DVec3::new(0.0, 0.0, 0.02));
        let start = Start { probe: Some(inside), grip_a: None, lead_out: true };
        run.restart(Some(start)).expect("it begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        until(&mut run, |run| run.numbers().ticks > 20);
        assert!(run.start().is_some(), "it begins inside");

        // Beginning the scene anew does not lead out.
        run.restart(None).expect("it begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        let led = |file: &str| {
            let recording = read_recording(&folder.join(file)).expect("a recording");
            recording.header.scene.more.contains_key("lead_out")
        };
        drop(run.end().expect("it ends"));
        assert_eq!(["run-2.csv", "run-3.csv"].map(led), [true, false]);
    });
}
