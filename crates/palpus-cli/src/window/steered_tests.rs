//! Requests of a window, tested without a window.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Parser;
use palpus::algebra::Pose;
use palpus::render::Settings;
use palpus_device::Guide;
use palpus_io::read_recording;
use palpus_io::scene::FilePolicy;
use palpus_window::{Cap, Loading, Run, Wanted};

use super::here::begin;
use super::steered::Steered;
use crate::args::RunArguments;
use crate::run::{self, Ready};
use crate::stage;

/// Long: the machine may have other things to do.
const PATIENCE: Duration = Duration::from_secs(120);

/// Looks once a frame until `done`.
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
    test(Steered::new(&arguments, session, &stop), &folder);
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
        let part = palpus_window::Part::Probe;
        run.load(Wanted::Mesh { file, part, metres_per_unit: 0.01 }).expect("it begins");
        until(&mut run, |run| run.loading() == Loading::Idle);
        until(&mut run, |run| run.numbers().ticks > 20);
        assert!(run.replaced().is_some() && run.record(false).is_ok() && run.recording().is_none());
        assert!(run.record(false).is_err(), "nothing is recorded any more");

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
