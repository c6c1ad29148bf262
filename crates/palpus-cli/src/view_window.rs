//! Windows that show a model or a recording, if there is a display and the program was built with
//! its window.

use anyhow::bail;

/// Ends the command with the reason why there is no window, and with alternatives. Does nothing if
/// there is a window.
pub(crate) fn expect_one(instead: &str) -> anyhow::Result<()> {
    match here::reason_for_none() {
        Some(reason) => bail!("there is no window here ({reason}); {instead}"),
        None => Ok(()),
    }
}

#[cfg(feature = "window")]
pub(crate) use here::{show_model, show_replay};

#[cfg(feature = "window")]
mod here {
    use anyhow::anyhow;
    use palpus_window::{Replayed, Viewed, WindowError, has_display, show_recording, view};

    pub(super) fn reason_for_none() -> Option<&'static str> {
        (!has_display()).then_some("no display")
    }

    /// Shows a model until its window is closed.
    pub(crate) fn show_model(viewed: Viewed, instead: &str) -> anyhow::Result<()> {
        view(viewed).map_err(|error| said(&error, instead))
    }

    /// Shows a recording until its window is closed.
    pub(crate) fn show_replay(replayed: Replayed, instead: &str) -> anyhow::Result<()> {
        show_recording(replayed).map_err(|error| said(&error, instead))
    }

    fn said(error: &WindowError, instead: &str) -> anyhow::Error {
        anyhow!("no window could be opened here ({error}); {instead}")
    }
}

#[cfg(not(feature = "window"))]
mod here {
    pub(super) fn reason_for_none() -> Option<&'static str> {
        Some("it was built without windows (--no-default-features)")
    }
}
