//! The window of a run.
//!
//! The window reads the newest values that the servo thread has published
//! ([`palpus_device::Newest`]), and sends requests through a [`Run`]; the loop never waits for the
//! window. One function builds the interface, once in each frame:
//!
//! 1. take the newest moment and numbers, and store the numbers for the plots;
//! 2. handle keys, which have the same actions as buttons;
//! 3. draw the panels: at the top the controls of the run, at the right its state and the contact
//!    settings, at the bottom the plots, and in the middle the scene, in which the mouse moves the
//!    probe or the camera.
//!
//! If a machine has no display, or its graphics library is missing or too old, an error names the
//! reason.

mod backdrop;
mod background;
mod bar;
mod beside;
mod canvas;
mod chart;
mod columns;
mod compass;
mod feel;
mod floor;
mod gl;
mod hand;
mod handles;
mod history;
mod icon;
mod interface;
mod keys;
mod opening;
mod overlay;
mod pace;
mod pick;
mod player;
mod plots;
mod quantity;
mod run;
mod run_keys;
mod scale;
mod shader;
mod shell;
mod shot;
mod slot;
mod spectrum;
mod status;
mod theme;
mod view3d;
mod viewer;

use palpus_device::Newest;

use crate::moment::Moment;
use crate::scene::Scene;
use interface::Interface;
pub use player::{Replayed, ReplayedTick, show_recording};
pub use run::{Cap, ComparedTick, FileKind, Loading, MeshFile, Numbers, Painted, Preset, Run, SeenTick, Start, Wanted};
pub use viewer::{Viewed, view};

/// Reason why there is no window.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// No display or no graphics library; the text gives the reason.
    #[error("{0}")]
    Unavailable(String),
}

/// True if there may be a display: on Linux and the BSDs, if an environment variable names one.
pub fn has_display() -> bool {
    if cfg!(any(windows, target_os = "macos")) {
        return true;
    }
    ["WAYLAND_DISPLAY", "WAYLAND_SOCKET", "DISPLAY"]
        .iter()
        .any(|name| std::env::var_os(name).is_some_and(|v| !v.is_empty()))
}

/// Shows `scene`, whose first body is the probe and whose second body is the environment, until the
/// user closes the window. Must be called on the main thread. `run`: the run of the scene.
///
/// # Errors
///
/// Fails if no window can be opened.
pub fn open(scene: Scene, moments: Newest<Moment>, run: &mut dyn Run) -> Result<(), WindowError> {
    let title = title(&scene);
    shell::show(&title, |creation| Ok(Box::new(Interface::new(creation, scene, moments, run)?)))
}

fn title(scene: &Scene) -> String {
    format!("palpus — {}", scene.title)
}
