//! The window beside the servo loop.
//!
//! It reads the newest values that the servo thread has left ([`palpus_device::Newest`]), and asks for what it wants through a
//! [`Run`]: the loop never waits for it. One function builds the interface, once a frame:
//!
//! 1. take the newest moment and numbers, and remember the numbers for the plots;
//! 2. keys, which ask for what buttons ask for too;
//! 3. above, what can be asked of the run; at the right, how it goes and what is felt; below, the last seconds; in the middle the scene,
//!    in which the mouse moves the probe or the eye.
//!
//! A machine without a display, or whose graphics library is missing or too old, is an error that says so.

mod bar;
mod dress;
mod feel;
mod gl;
mod hand;
mod history;
mod icon;
mod interface;
mod keys;
mod opening;
mod overlay;
mod pick;
mod plots;
mod quantity;
mod run;
mod shader;
mod shot;
mod status;
mod view3d;

use std::panic::{AssertUnwindSafe, catch_unwind};

use eframe::egui;
use palpus_device::Newest;

use crate::moment::Moment;
use crate::scene::Scene;
use interface::Interface;
pub use run::{Cap, FileKind, Loading, Numbers, Painted, Part, Preset, Run, Wanted};

/// Why there is no window.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// Nothing to draw on, or no library to draw with; in words.
    #[error("{0}")]
    Unavailable(String),
}

/// True if there may be a display: on Linux and the BSDs, if one is named by the environment.
pub fn has_display() -> bool {
    if cfg!(any(windows, target_os = "macos")) {
        return true;
    }
    ["WAYLAND_DISPLAY", "WAYLAND_SOCKET", "DISPLAY"]
        .iter()
        .any(|name| std::env::var_os(name).is_some_and(|v| !v.is_empty()))
}

/// Shows `scene`, whose first body is the probe and whose second the environment, until the user closes the window; must be called
/// on the main thread. `run` is what goes on behind it.
///
/// # Errors
/// When no window can be opened here.
pub fn open(scene: Scene, moments: Newest<Moment>, run: &mut dyn Run) -> Result<(), WindowError> {
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title(title(&scene))
            .with_inner_size([1280.0, 860.0])
            .with_min_inner_size([640.0, 480.0]),
        depth_buffer: 24,
        ..eframe::NativeOptions::default()
    };
    let show = || {
        eframe::run_native(
            "palpus",
            options,
            Box::new(|creation| Ok(Box::new(Interface::new(creation, scene, moments, run)?))),
        )
    };
    // The window library panics where one of its shared libraries is missing.
    match catch_unwind(AssertUnwindSafe(show)) {
        Ok(Ok(())) => Ok(()),
        Ok(Err(error)) => Err(WindowError::Unavailable(last_part(&error.to_string()))),
        Err(panic) => {
            let said = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
            Err(WindowError::Unavailable(said.unwrap_or("the window library failed").to_owned()))
        }
    }
}

fn title(scene: &Scene) -> String {
    format!("palpus — {}", scene.title)
}

/// Errors of the window library begin with where in its sources they arose; what happened comes last.
fn last_part(error: &str) -> String {
    error
        .rsplit(".rs:")
        .next()
        .map_or(error, |rest| rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == ':'))
        .trim()
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_told_without_places_in_sources() {
        assert_eq!(last_part("winit EventLoopError: os error at a/b/mod.rs:788: Failed to open"), "Failed to open");
        assert_eq!(last_part("no config found"), "no config found");
    }
}
