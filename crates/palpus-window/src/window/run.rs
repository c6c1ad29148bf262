//! The interface between the window and the run behind it.
//!
//! The window draws and asks; a [`Run`] answers. All calls come from the window's thread and return
//! at once: slow work (preparing a mesh) goes on elsewhere and is polled in each frame, and
//! requests reach the servo loop as a newest value, never by waiting. Frames: poses are the probe's
//! in the world.

use std::path::{Path, PathBuf};

use glam::DVec3;
use palpus::algebra::{Pose, Twist};
use palpus::render::Settings;
use palpus_device::{Cuts, DeviceSpec, Guide, Newest, Phase};

use crate::moment::Moment;
use crate::scene::Scene;

/// A run of the servo loop that is watched and steered. See the module's description for threads
/// and frames.
pub trait Run {
    /// The newest numbers. Ticks are counted from the beginning of the run; they may begin anew
    /// when the scene is replaced.
    fn numbers(&mut self) -> Numbers;

    /// Every tick since the last call, oldest first; those for which there was no room are left
    /// out.
    fn ticks(&mut self, each: &mut dyn FnMut(SeenTick));

    /// Starts a comparison: from now on, the same ticks are also computed with other settings, from
    /// the same device poses. The result is not sent to the device. `None` ends the comparison.
    ///
    /// # Errors
    /// In words, when it cannot be.
    fn compare(&mut self, with: Option<&Settings>) -> Result<(), String>;

    /// Passes the ticks computed with other settings since the last call, oldest first, and returns
    /// the newest moment of them, if there is one.
    fn compared(&mut self, each: &mut dyn FnMut(ComparedTick)) -> Option<&Moment>;

    /// The device, for its name, its limits and its workspace.
    fn device(&self) -> &DeviceSpec;

    /// The engine's settings as they are from the next tick on.
    fn settings(&self) -> Settings;

    /// Changes the settings from the next tick on. Capacity and limits stay as they are.
    ///
    /// # Errors
    /// Fails with a message if the settings cannot be used; the run then keeps its old settings.
    fn set_settings(&mut self, settings: &Settings) -> Result<(), String>;

    /// The settings as lines of a scene file.
    fn settings_as_toml(&self) -> String;

    /// Presets: first palpus's own settings for this scene on this device, second the paper's, then
    /// any others.
    fn presets(&self) -> Vec<Preset>;

    /// True if a person at the window may move the probe: a simulated hand, not a device in a real
    /// one.
    fn can_guide(&self) -> bool;

    /// The simulated hand intends this pose of the probe (its mesh's frame, world) from now on, and
    /// goes there as fast as hands do; or lets go of it, or goes back to its script. Without a
    /// simulated hand this does nothing.
    fn guide(&mut self, guide: Guide);

    /// Called in every frame: the key for force is held, or not.
    fn hold(&mut self, held: bool);

    /// Message about a probe that began inside the part, if it did.
    fn start(&self) -> Option<String>;

    /// Condition for force to come, if it is known.
    fn waits_for(&self) -> Option<String>;

    /// Why there was no contact so far, and what to do, if the run is long enough for one.
    fn untouched(&mut self) -> Option<String>;

    /// How far a SpaceMouse is being pushed, if there is one to guide the probe with.
    fn cap(&mut self) -> Cap;

    /// Stops the loop's time, with no force, or lets it go on.
    ///
    /// # Errors
    /// In words, where it cannot be stopped.
    fn pause(&mut self, paused: bool) -> Result<(), String>;

    /// True while the loop is paused.
    fn is_paused(&self) -> bool;

    /// In a pause: runs this many ticks, then pauses again.
    fn step(&mut self, ticks: u64);

    /// Begins a recording in a file of its own, or ends it.
    ///
    /// # Errors
    /// In words, when the file cannot be written.
    fn record(&mut self, on: bool) -> Result<PathBuf, String>;

    /// The file that is being written, while there is one.
    fn recording(&self) -> Option<PathBuf>;

    /// Description of a failure of the recording while the run went on.
    fn recording_trouble(&self) -> Option<String>;

    /// The built-in scenes: name, and description.
    fn scenes(&self) -> Vec<(String, String)>;

    /// Returns the function that reads a file to find its kind. The window calls it on a thread of
    /// its own.
    fn reader(&self) -> fn(&Path) -> Result<FileKind, String>;

    /// Starts to prepare the next scene, while the loop goes on with the current one.
    ///
    /// # Errors
    /// Fails with a description if it cannot start. Later failures come by [`Run::loading`].
    fn load(&mut self, wanted: Wanted) -> Result<(), String>;

    /// Restarts the scene with all bodies at their start poses, and the probe at `at`, if given.
    ///
    /// # Errors
    /// As [`Run::load`].
    fn restart(&mut self, at: Option<Start>) -> Result<(), String>;

    /// Saves the scene with the settings as they are, in a new file that can be run.
    ///
    /// # Errors
    /// In words, when it cannot be written.
    fn save(&mut self) -> Result<PathBuf, String>;

    /// Files that were opened of late, newest first.
    fn recent(&self) -> Vec<PathBuf>;

    /// Progress of the preparation. A failure is reported until the next [`Run::load`].
    fn loading(&mut self) -> Loading;

    /// Returns the new scene and its moments, once after it has replaced the old one.
    fn replaced(&mut self) -> Option<(Scene, Newest<Moment>)>;

    /// The loop has ended by itself.
    fn is_over(&self) -> bool;

    /// True if the window goes when the loop has ended.
    fn closes_when_over(&self) -> bool;

    /// Called when the window closes, with statistics of its frames.
    fn painted(&mut self, _: Painted) {}
}

/// How a window was drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Painted {
    /// Frames.
    pub frames: u64,
    /// Frames a second, from the first frame to the last; 0 with fewer than two.
    pub rate_hz: f64,
    /// The renderer's name in the graphics library.
    pub renderer: String,
    /// Triangles of the bodies, as they are drawn.
    pub triangles: usize,
    /// Samples in each pixel of them.
    pub samples: u32,
}

/// Values of one tick for texts and plots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers {
    /// Since the run began.
    pub ticks: u64,
    /// Ticks per second that the loop is to make.
    pub rate_hz: f64,
    /// s since the run began, counted in ticks.
    pub time: f64,
    /// N, as the device got it.
    pub force: f64,
    /// N·m.
    pub torque: f64,
    /// s: what finding contacts and depths took.
    pub query: f64,
    /// s: what computing forces took.
    pub force_time: f64,
    /// Step over the period, of late.
    pub load: f64,
    /// Recent share of the contacts that were extrapolated from the previous tick, since a step's
    /// work is bounded.
    pub carried: f64,
    /// Ticks whose wrench came more than a period late.
    pub overruns: u64,
    /// Times that a fault took the force away.
    pub faults: u64,
    /// Number of contacts with a separation below the tolerance.
    pub contacts: u32,
    /// Groups of contacts that share a force.
    pub clusters: u32,
    /// Separation of the deepest contact, m, negative in overlap; infinite without contacts.
    pub separation: f64,
    /// Interventions of the safety chain in this tick.
    pub cuts: Cuts,
    /// Phase of the engagement.
    pub phase: Phase,
    /// Translation from the probe to where force can begin, world, m; `None` unless the run waits
    /// for that and it is known.
    pub way_out: Option<DVec3>,
}

impl Default for Numbers {
    /// Before the first tick.
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
    /// s since the run began, counted in ticks.
    pub time: f64,
    /// N, as the device got it, world.
    pub force: DVec3,
    /// N·m, about the grip, world.
    pub torque: DVec3,
    /// s: what finding contacts and depths took.
    pub query: f64,
    /// s: what computing forces took.
    pub force_time: f64,
    /// Number of contacts with a separation below the tolerance.
    pub contacts: u32,
    /// m: of the deepest contact, negative where the bodies overlap.
    pub separation: f64,
}

/// The same by other settings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ComparedTick {
    /// Time since the run began, s.
    pub time: f64,
    /// N, world: what the device would get, before its safety chain.
    pub force: DVec3,
    /// N·m, about the grip, world.
    pub torque: DVec3,
}

/// Settings by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Preset {
    /// As it stands on its button.
    pub name: &'static str,
    /// All of them.
    pub settings: Settings,
}

/// State of a SpaceMouse.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Cap {
    /// No SpaceMouse was found.
    #[default]
    None,
    /// There is one that may not be read; why, and what mends it.
    Unusable(String),
    /// How it is pushed: as a speed of the hand, m/s and rad/s, x to the right, y away from the
    /// user, z up.
    Pushed(Twist),
}

/// Kind of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FileKind {
    /// A scene file, which is complete by itself.
    Scene,
    /// A mesh, whose unit the file does not give.
    Mesh {
        /// Sides of the box about it, in the file's unit.
        size: DVec3,
        /// How many.
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
    /// Meshes in the place of the two bodies; a body without one stays.
    Meshes {
        /// The probe.
        probe: Option<MeshFile>,
        /// The environment.
        environment: Option<MeshFile>,
    },
}

/// A mesh, and what its numbers mean.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// Path of the file.
    pub file: PathBuf,
    /// m, of the file's unit.
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
    /// m, in the frame of its mesh; `None` for the scene's own.
    pub grip_a: Option<DVec3>,
    /// The device leads the probe out first, if it overlaps the environment or an object there.
    pub lead_out: bool,
}

/// How far preparing has come.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Loading {
    /// There is nothing to prepare.
    #[default]
    Idle,
    /// It is in progress.
    UnderWay {
        /// Description of the current work.
        words: String,
        /// How much is done, 0 to 1, where that can be said.
        part: Option<f64>,
    },
    /// It failed, in words.
    Failed(String),
}
