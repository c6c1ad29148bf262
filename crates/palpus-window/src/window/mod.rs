//! The window beside the servo loop.
//!
//! It reads the newest values that the servo thread has left ([`palpus_device::Newest`]) and nothing else: the loop neither
//! waits for it nor knows of it. One function builds the interface, once a frame:
//!
//! 1. take the newest moment and numbers, and remember the numbers for the plots;
//! 2. keys;
//! 3. what there is to say and to choose, on the right; plots below; the scene in the middle, turned, moved and neared by
//!    the mouse.
//!
//! A machine without a display, or whose graphics library is missing or too old, is an error that says so.

mod gl;
mod history;
mod interface;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicBool;

use eframe::egui;
use palpus_device::{Newest, Phase};

use crate::moment::Moment;
use crate::scene::Scene;
use interface::Interface;

/// What the window says in words and plots, of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Numbers {
    /// Since the run began.
    pub ticks: u64,
    /// s since the run began, counted in ticks.
    pub time: f64,
    /// N, as the device got it.
    pub force: f64,
    /// N·m.
    pub torque: f64,
    /// s: what finding contacts and depths took.
    pub query: f64,
    /// s: the longest step so far.
    pub worst_step: f64,
    /// Ticks whose wrench came more than a period late.
    pub overruns: u64,
    /// Ticks in which a fault took the force away.
    pub faults: u64,
    /// Contacts nearer than the tolerance.
    pub contacts: u32,
    /// Where the engagement stands.
    pub phase: Phase,
}

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

/// Shows `scene`, whose first body is the probe, until the user closes the window; must be called on the main thread.
///
/// `numbers` answers the newest ones. `over` says that the run has ended; the window then goes too if `closes` says so.
///
/// # Errors
/// When no window can be opened here.
pub fn open(
    scene: Scene,
    moments: Newest<Moment>,
    numbers: &mut dyn FnMut() -> Numbers,
    over: &AtomicBool,
    closes: &dyn Fn() -> bool,
) -> Result<(), WindowError> {
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title(format!("palpus — {}", scene.title))
            .with_inner_size([1280.0, 860.0])
            .with_min_inner_size([640.0, 480.0]),
        depth_buffer: 24,
        ..eframe::NativeOptions::default()
    };
    let run = || {
        eframe::run_native(
            "palpus",
            options,
            Box::new(|creation| Ok(Box::new(Interface::new(creation, scene, moments, numbers, over, closes)?))),
        )
    };
    // The window library panics where one of its shared libraries is missing.
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(Ok(())) => Ok(()),
        Ok(Err(error)) => Err(WindowError::Unavailable(last_part(&error.to_string()))),
        Err(panic) => {
            let said = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
            Err(WindowError::Unavailable(said.unwrap_or("the window library failed").to_owned()))
        }
    }
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
