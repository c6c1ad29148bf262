//! Tests of a window's requests, without a window.

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
use crate::stage::{self, Stage};

/// Timeout. It is long, since the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(120);

/// A cube of side 2 about the origin.
const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// Polls like a window, once per frame, until `done` returns true.
fn until(run: &mut Steered<'_>, done: impl Fn(&mut Steered<'_>) -> bool) {
    let begin = Instant::now();
    while !done(run) {
        assert!(begin.elapsed() < PATIENCE, "the request is not fulfilled: {:?}", run.loading());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Starts a run of `pen-sphere` for `test`, which gets a folder of its own.
fn with_run(name: &str, test: impl FnOnce(Steered<'_>, &Path)) {
    let built_in = |_: &Path| stage::prepare("pen-sphere", FilePolicy::Inside).expect("the scene is built in");
    with_run_of(name, built_in, test);
}

/// The same with the stage that `prepare` makes; it gets the folder.
fn with_run_of(name: &str, prepare: impl FnOnce(&Path) -> Stage, test: impl FnOnce(Steered<'_>, &Path)) {
    crate::bodies::use_cache(false);
    let folder: PathBuf = std::env::temp_dir().join(format!("palpus-steered-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("the folder can be created");
    let record = folder.join("run.csv").display().to_string();
    let arguments = RunArguments::parse_from(["run", "pen-sphere", "--no-realtime", "--record", &record]);
    let stop = Arc::new(AtomicBool::new(false));
    let stage = prepare(&folder);
    let ready = Ready::new(&arguments, "pen-sphere", stage, true).expect("the run can be prepared");
    let (session, scene, _) = begin(ready, &run::beginning(&arguments), &stop).expect("the session starts");
    assert_eq!(scene.bodies.len(), 2);
    let recent = Recent::kept_in(Some(folder.join("recent.txt")));
    test(Steered::new(&arguments, session, recent, &stop), &folder);
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn run_is_steered_then_replaced_by_scene_and_mesh() {
    with_run("followed", |mut run, folder| {
        until(&mut run, |run| run.numbers().ticks > 20);
        assert!(run.can_guide() && !run.is_over() && !run.closes_when_over());
        assert!(matches!(run.cap(), Cap::None | Cap::Unusable(_)));
        run.guide(Guide::Held(Pose::IDENTITY));
        let paper = run.presets()[1].settings;
        run.set_settings(&paper).expect("the settings are valid");
        assert_eq!(run.settings(), paper);
        assert!(run.set_settings(&Settings { stiffness: f64::NAN, ..paper }).is_err());
        run.pause(true).expect("the run can be paused");
        assert!(run.is_paused());
        run.pause(false).expect("the run can continue");

        // A scene that cannot be prepared gives an error of one line, and the run continues.
        let nowhere = Wanted::SceneFile(folder.join("nowhere.toml"));
        run.load(nowhere).expect("the loading starts");
        until(&mut run, |run| matches!(run.loading(), Loading::Failed(_)));
        let Loading::Failed(why) = run.loading() else { unreachable!() };
        assert!(why.contains("nowhere.toml") && !why.contains('\n'), "{why}");
        assert!(run.replaced().is_none() && !run.is_over());

        run.load(Wanted::Scene("box-table".to_owned())).expect("the loading starts");
        until(&mut run, |run| run.loading() == Loading::Idle);
        let (scene, _) = run.replaced().expect("the scene is replaced");
        assert!(scene.title == "box-table" && run.replaced().is_none());
        assert_eq!(run.recording(), Some(folder.join("run-2.csv")));
        until(&mut run, |run| run.numbers().ticks > 20);

        let file = folder.join("cube.obj");
        std::fs::write(&file, CUBE).expect("the file can be written");
        let probe = Some(MeshFile { file, metres_per_unit: 0.01 });
        run.load(Wanted::Meshes { probe, environment: None }).expect("the loading starts");
        until(&mut run, |run| run.loading() == Loading::Idle);
        until(&mut run, |run| run.numbers().ticks > 20);
        assert!(run.replaced().is_some() && run.record(false).is_ok() && run.recording().is_none());
        assert!(run.record(false).is_err(), "there must be no recording to stop");

        let opened = run.recent();
        assert_eq!(opened.len(), 1);
        assert!(opened[0].ends_with("cube.obj"), "{opened:?}");

        let ended = run.end().expect("the run ends");
        assert_eq!(ended.len(), 3);
        for run in &ended {
            let recording = read_recording(&run.devices[0].recordings[0]).expect("the recording can be read");
            assert!(!recording.rows.is_empty() && recording.rows[0].tick == 0, "{}", run.name);
        }
        assert!(folder.join("scenes/cube/scene.toml").is_file());
        assert_eq!(read_recording(&folder.join("run.csv")).expect("the recording can be read").changes.len(), 1);
    });
}

#[test]
fn scene_restarts_at_given_start_and_is_saved() {
    with_run("anew", |mut run, folder| {
        until(&mut run, |run| run.numbers().ticks > 20);
        let start = Start {
            probe: Some(Pose::from_translation(DVec3::new(0.01, 0.02, 0.3))),
            grip_a: Some(DVec3::new(0.0, 0.0, 0.004)),
            lead_out: false,
        };
        run.restart(Some(start)).expect("the restart begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        let (scene, _) = run.replaced().expect("the scene is restarted");
        assert_eq!(Some(scene.bodies[0].pose), start.probe);
        assert_eq!(Some(run.settings().grip_a), start.grip_a);
        let wanted = Settings { stiffness: 1234.0, ..run.settings() };
        run.set_settings(&wanted).expect("the settings are valid");
        let file = run.save().expect("the scene can be saved");
        assert!(file.starts_with(folder.join("scenes")), "{}", file.display());
        assert_eq!(run.recent(), std::slice::from_ref(&file));

        // Restarts the original scene, then loads the saved scene.
        run.restart(None).expect("the restart begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        let (scene, _) = run.replaced().expect("the scene is restarted");
        assert!(Some(scene.bodies[0].pose) != start.probe && Some(run.settings().grip_a) != start.grip_a);
        run.load(Wanted::SceneFile(file)).expect("the loading starts");
        until(&mut run, |run| run.loading() == Loading::Idle);
        let (scene, _) = run.replaced().expect("the saved scene is loaded");
        let probe = scene.bodies[0].pose.translation;
        assert!((probe - DVec3::new(0.01, 0.02, 0.3)).length() < 1e-9, "{probe}");
        assert!((run.settings().stiffness - 1234.0).abs() < 1e-6);
    });
}

#[test]
fn two_meshes_without_a_scene_file_restart_and_are_saved() {
    let pair = |folder: &Path| {
        let files = ["tool.obj", "part.obj"].map(|name| folder.join(name).display().to_string());
        files.iter().for_each(|file| std::fs::write(file, CUBE).expect("the file can be written"));
        stage::of_pair(files.each_ref().map(String::as_str), &["cm".to_owned()]).expect("the pair can be prepared")
    };
    with_run_of("pair", pair, |mut run, folder| {
        run.restart(None).expect("the restart begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        assert!(run.replaced().is_some(), "the pair must start again");
        let stiffness = run.settings().stiffness;
        run.set_settings(&Settings { stiffness: 1234.0, ..run.settings() }).expect("the settings are valid");
        let saved = run.save().expect("the scene can be saved");
        // The file does not replace the scene, but it can be opened.
        run.restart(None).expect("the restart begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        assert_eq!(run.settings().stiffness, stiffness);
        assert_eq!(Some(&saved), folder.canonicalize().ok().map(|folder| folder.join("tool-part.toml")).as_ref());
        // The part stays.
        let file = folder.join("other.obj");
        std::fs::write(&file, CUBE).expect("the file can be written");
        let probe = Some(MeshFile { file, metres_per_unit: 0.02 });
        run.load(Wanted::Meshes { probe, environment: None }).expect("the loading starts");
        until(&mut run, |run| run.loading() == Loading::Idle);
        let (scene, _) = run.replaced().expect("the probe is replaced");
        assert_eq!(scene.bodies.len(), 2);
        run.load(Wanted::SceneFile(saved)).expect("the loading starts");
        until(&mut run, |run| run.loading() == Loading::Idle);
        assert!((run.settings().stiffness - 1234.0).abs() < 1e-6);
    });
}

#[test]
fn probe_inside_is_led_out_on_request() {
    with_run("led-out", |mut run, folder| {
        until(&mut run, |run| run.numbers().ticks > 20);
        let inside = Pose::from_translation(DVec3::new(0.0, 0.0, 0.02));
        let start = Start { probe: Some(inside), grip_a: None, lead_out: true };
        run.restart(Some(start)).expect("the restart begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        until(&mut run, |run| run.numbers().ticks > 20);
        assert!(run.start().is_some(), "the probe must start inside the part");

        // A restart of the scene must not lead the probe out.
        run.restart(None).expect("the restart begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        let led = |file: &str| {
            let recording = read_recording(&folder.join(file)).expect("the recording can be read");
            recording.header.scene.more.contains_key("lead_out")
        };
        drop(run.end().expect("the run ends"));
        assert_eq!(["run-2.csv", "run-3.csv"].map(led), [true, false]);
    });
}
