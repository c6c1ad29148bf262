//! The interface between the window and the run.
//!
//! The window draws and sends requests; a [`Run`] answers. All calls come from the window's thread
//! and return at once. Slow work (preparing a mesh) is done on other threads and polled in each
//! frame. Requests reach the servo loop as newest values, without waiting. Poses place the probe in
//! the world.

use std::path::{Path, PathBuf};

use glam::DVec3;
use palpus::algebra::{Pose, Twist};
use palpus::render::Settings;
use palpus_device::{Cuts, DeviceSpec, Guide, Newest, Phase};

use crate::moment::Moment;
use crate::scene::Scene;

/// A run of the servo loop that the window shows and controls. See the module's description for
/// threads and frames.
pub trait Run {
    /// Returns the newest numbers. Ticks are counted from the beginning of the run; the count may
    /// start again when the scene is replaced.
    fn numbers(&mut self) -> Numbers;

    /// Passes every tick since the last call to `each`, oldest first. Ticks that exceeded the
    /// capacity are missing.
    fn ticks(&mut self, each: &mut dyn FnMut(SeenTick));

    /// Starts a comparison: from now on, the same ticks are also computed with other settings, from
    /// the same device poses. The result is not sent to the device. `None` ends the comparison.
    ///
    /// # Errors
    ///
    /// Fails with a message if a comparison is not possible.
    fn compare(&mut self, with: Option<&Settings>) -> Result<(), String>;

    /// Passes the ticks computed with other settings since the last call, oldest first. Returns
    /// their newest moment, if there is one.
    fn compared(&mut self, each: &mut dyn FnMut(ComparedTick)) -> Option<&Moment>;

    /// Returns the description of the device.
    fn device(&self) -> &DeviceSpec;

    /// Returns the engine's settings from the next tick on.
    fn settings(&self) -> Settings;

    /// Changes the settings from the next tick on. Capacity and limits stay the same.
    ///
    /// # Errors
    ///
    /// Fails with a message if the settings are not valid; the run then keeps its old settings.
    fn set_settings(&mut self, settings: &Settings) -> Result<(), String>;

    /// Returns the settings as lines of a scene file.
    fn settings_as_toml(&self) -> String;

    /// Returns the presets: first palpus's own settings for this scene on this device, second the
    /// paper's, then any others.
    fn presets(&self) -> Vec<Preset>;

    /// True if the user may move the probe in the window: there is a simulated hand, and no real
    /// device.
    fn can_guide(&self) -> bool;

    /// Sets the target pose of the probe (its mesh's frame, world), which the simulated hand
    /// approaches at the speed of a hand; or lets the hand release the probe, or return to its
    /// script. Without a simulated hand, this function does nothing.
    fn guide(&mut self, guide: Guide);

    /// Tells the run in every frame whether the key for force is held.
    fn hold(&mut self, held: bool);

    /// Returns the message about a probe that started inside the part. `None` if it did not start
    /// inside.
    fn start(&self) -> Option<String>;

    /// Returns the condition for the force to begin, if it is known.
    fn waits_for(&self) -> Option<String>;

    /// Returns the reason for no contact so far, and a remedy, if the run is long enough.
    fn untouched(&mut self) -> Option<String>;

    /// Returns the state of a SpaceMouse that can move the probe.
    fn cap(&mut self) -> Cap;

    /// Pauses the loop without force, or continues it.
    ///
    /// # Errors
    ///
    /// Fails with a message if the loop cannot be paused.
    fn pause(&mut self, paused: bool) -> Result<(), String>;

    /// True while the loop is paused.
    fn is_paused(&self) -> bool;

    /// Runs this many ticks during a pause, then pauses again.
    fn step(&mut self, ticks: u64);

    /// Starts a recording in its own file, or ends it.
    ///
    /// # Errors
    ///
    /// Fails with a message if the file cannot be written.
    fn record(&mut self, on: bool) -> Result<PathBuf, String>;

    /// Returns the file of the current recording, if there is one.
    fn recording(&self) -> Option<PathBuf>;

    /// Returns the error of the recording during the run, if there was one.
    fn recording_trouble(&self) -> Option<String>;

    /// Returns the built-in scenes: name and description.
    fn scenes(&self) -> Vec<(String, String)>;

    /// Returns the function that reads a file to find its kind. The window calls it on a separate
    /// thread.
    fn reader(&self) -> fn(&Path) -> Result<FileKind, String>;

    /// Starts to prepare the next scene, while the loop goes on with the current scene.
    ///
    /// # Errors
    ///
    /// Fails with a description if the preparation cannot start. Later failures come by
    /// [`Run::loading`].
    fn load(&mut self, wanted: Wanted) -> Result<(), String>;

    /// Restarts the scene with all bodies at their start poses, and with the probe at `at`, if
    /// given.
    ///
    /// # Errors
    ///
    /// Fails like [`Run::load`].
    fn restart(&mut self, at: Option<Start>) -> Result<(), String>;

    /// Saves the scene with the current settings in a new file that can be run.
    ///
    /// # Errors
    ///
    /// Fails with a message if the file cannot be written.
    fn save(&mut self) -> Result<PathBuf, String>;

    /// Returns the recently opened files, newest first.
    fn recent(&self) -> Vec<PathBuf>;

    /// Returns the progress of the preparation. A failure is reported until the next [`Run::load`].
    fn loading(&mut self) -> Loading;

    /// Returns the new scene and its moments, once after the new scene has replaced the old scene.
    fn replaced(&mut self) -> Option<(Scene, Newest<Moment>)>;

    /// True if the loop has ended by itself.
    fn is_over(&self) -> bool;

    /// True if the window closes when the loop has ended.
    fn closes_when_over(&self) -> bool;

    /// Gets statistics of the frames when the window closes.
    fn painted(&mut self, _: Painted) {}
}

/// Statistics of the drawing of a window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Painted {
    /// Number of frames.
    pub frames: u64,
    /// Frames per second, from the first frame to the last; 0 with fewer than two frames.
    pub rate_hz: f64,
    /// The renderer's name according to the graphics library.
    pub renderer: String,
    /// Number of triangles of the bodies, as drawn.
    pub triangles: usize,
    /// Number of samples in each pixel.
    pub samples: u32,
}

/// Values of one tick for texts and plots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers {
    /// Number of ticks since the run began.
    pub ticks: u64,
    /// Nominal ticks per second.
    pub rate_hz: f64,
    /// Time since the run began, counted in ticks, s.
    pub time: f64,
    /// Force that the device got, N.
    pub force: f64,
    /// Torque that the device got, N·m.
    pub torque: f64,
    /// Time for contacts and depths, s.
    pub query: f64,
    /// Time for forces, s.
    pub force_time: f64,
    /// Recent ratio of the step to the period.
    pub load: f64,
    /// Recent share of the contacts that were extrapolated from the previous tick, because a step's
    /// work is limited.
    pub carried: f64,
    /// Number of ticks whose wrench was written more than a period late.
    pub overruns: u64,
    /// Number of times that a fault removed the force.
    pub faults: u64,
    /// Number of contacts with a separation below the tolerance.
    pub contacts: u32,
    /// Number of groups of contacts that share a force.
    pub clusters: u32,
    /// Separation of the deepest contact, m, negative in overlap; infinite without contacts.
    pub separation: f64,
    /// Interventions of the safety chain in this tick.
    pub cuts: Cuts,
    /// Phase of the start-up.
    pub phase: Phase,
    /// Translation from the probe to the place at which force can begin, world, m. `None` unless
    /// the run waits for this translation and knows it.
    pub way_out: Option<DVec3>,
}

impl Default for Numbers {
    /// Returns the numbers before the first tick.
    fn default() -> Self {
        Self {
            ticks: 0,
            rate_hz: 0.0,
            time: 0.0,
            force: 0.0,
            torque: 0.0,
            query: 0.0,
            force_time: 0.0,
            load: 0.0,
            carried: 0.0,
            overruns: 0,
            faults: 0,
            contacts: 0,
            clusters: 0,
            separation: f64::INFINITY,
            cuts: Cuts::NONE,
            phase: Phase::default(),
            way_out: None,
        }
    }
}

/// One tick, for the plots.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeenTick {
    /// Time since the run began, counted in ticks, s.
    pub time: f64,
    /// Force that the device got, N, world.
    pub force: DVec3,
    /// Torque that the device got, about the grip, N·m, world.
    pub torque: DVec3,
    /// Time for contacts and depths, s.
    pub query: f64,
    /// Time for forces, s.
    pub force_time: f64,
    /// Number of contacts with a separation below the tolerance.
    pub contacts: u32,
    /// Separation of the deepest contact, m; negative where the bodies overlap.
    pub separation: f64,
}

/// A tick computed with other settings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ComparedTick {
    /// Time since the run began, s.
    pub time: f64,
    /// Force that the device would get, before its safety chain, N, world.
    pub force: DVec3,
    /// Torque about the grip, N·m, world.
    pub torque: DVec3,
}

/// Settings by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Preset {
    /// Text of its button.
    pub name: &'static str,
    /// The settings.
    pub settings: Settings,
}

/// State of a SpaceMouse.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Cap {
    /// No SpaceMouse was found.
    #[default]
    None,
    /// A SpaceMouse that may not be read: the reason and a remedy.
    Unusable(String),
    /// The push as a speed of the hand, m/s and rad/s: x to the right, y away from the user, z up.
    Pushed(Twist),
}

/// Kind of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FileKind {
    /// A scene file, which is complete.
    Scene,
    /// A mesh, whose unit the file does not state.
    Mesh {
        /// Sides of its box, in the file's unit.
        size: DVec3,
        /// Number of triangles.
        triangles: usize,
    },
}

/// The next scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Wanted {
    /// A built-in scene, by name.
    Scene(String),
    /// A scene file.
    SceneFile(PathBuf),
    /// Meshes that replace the two bodies; a body without a mesh stays.
    Meshes {
        /// The probe.
        probe: Option<MeshFile>,
        /// The environment.
        environment: Option<MeshFile>,
    },
}

/// A mesh with its unit.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// Path of the file.
    pub file: PathBuf,
    /// The file's unit, m.
    pub metres_per_unit: f64,
}

impl MeshFile {
    /// Returns the file's name without its ending.
    pub fn stem(&self) -> String {
        self.file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }
}

/// Start and grip of the probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Pose of its mesh, world; `None` for the scene's own.
    pub probe: Option<Pose>,
    /// Grip in the frame of its mesh, m; `None` for the scene's own.
    pub grip_a: Option<DVec3>,
    /// True if the device leads the probe out first, if the probe overlaps the environment or an
    /// object at this pose.
    pub lead_out: bool,
}

/// Progress of the preparation.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Loading {
    /// Nothing is being prepared.
    #[default]
    Idle,
    /// The preparation is in progress.
    UnderWay {
        /// Description of the current work.
        words: String,
        /// Finished share, 0 to 1, if known.
        part: Option<f64>,
    },
    /// The preparation failed; the text describes the error.
    Failed(String),
}
