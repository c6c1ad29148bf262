//! Opens windows, and holds functions that all windows of the program share.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};

use eframe::egui::{self, RichText, TextureHandle, TextureOptions};

use super::{WindowError, shot};
use crate::picture::Picture;

/// Opens a window called `title` with the app from `app`, until the user closes it; must be called
/// on the main thread.
///
/// # Errors
///
/// Fails if no window can be opened.
pub(super) fn show<'a>(
    title: &str,
    app: impl FnOnce(&eframe::CreationContext<'_>) -> Result<Box<dyn eframe::App + 'a>, String> + 'a,
) -> Result<(), WindowError> {
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title(title)
            .with_inner_size([1280.0, 860.0])
            .with_min_inner_size([640.0, 480.0]),
        depth_buffer: 24,
        // No dithering: panels are flat, and the background of scenes is drawn without egui.
        dithering: false,
        ..eframe::NativeOptions::default()
    };
    let run = || eframe::run_native("palpus", options, Box::new(|creation| Ok(app(creation)?)));
    // The window library panics if one of its shared libraries is missing.
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(Ok(())) => Ok(()),
        Ok(Err(error)) => Err(WindowError::Unavailable(last_part(&error.to_string()))),
        Err(panic) => {
            let said = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
            Err(WindowError::Unavailable(said.unwrap_or("the window library failed").to_owned()))
        }
    }
}

/// Returns the last part of an error of the window library, which is the cause. The error begins
/// with the place in the library's source.
fn last_part(error: &str) -> String {
    error
        .rsplit(".rs:")
        .next()
        .map_or(error, |rest| rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == ':'))
        .trim()
        .to_owned()
}

/// The line in which a window reports its last action.
#[derive(Clone, Debug)]
pub(super) struct Status(Arc<Mutex<String>>);

impl Status {
    pub(super) fn new(words: &str) -> Self {
        Self(Arc::new(Mutex::new(words.to_owned())))
    }

    pub(super) fn say(&self, words: impl Into<String>) {
        if let Ok(mut said) = self.0.lock() {
            *said = words.into();
        }
    }

    pub(super) fn show(&self, ui: &mut egui::Ui) {
        if let Ok(said) = self.0.lock() {
            ui.label(said.as_str());
        }
    }

    /// Writes a picture of the whole window into a file, and reports its name.
    pub(super) fn screenshot(&self, context: &egui::Context) {
        let status = self.clone();
        context.request_screenshot(move |image| match shot::keep(&image) {
            Ok(file) => status.say(format!("written: {}", file.display())),
            Err(problem) => status.say(problem),
        });
    }
}

/// Space above the first line of a panel at the side, points.
pub(super) const TOP: f32 = 6.0;

/// Replaces a picture that egui shows.
pub(super) fn show_picture(context: &egui::Context, slot: &mut Option<TextureHandle>, picture: &Picture) {
    let image = egui::ColorImage::from_rgb([picture.width(), picture.height()], picture.bytes());
    match slot {
        Some(texture) => texture.set(image, TextureOptions::LINEAR),
        None => *slot = Some(context.load_texture("picture", image, TextureOptions::LINEAR)),
    }
}

/// Writes names and values in two columns.
pub(super) fn rows<'r>(ui: &mut egui::Ui, name: &str, rows: impl IntoIterator<Item = (&'r str, String)>) {
    egui::Grid::new(name).num_columns(2).spacing([18.0, 3.0]).show(ui, |ui| {
        for (name, value) in rows {
            ui.label(name);
            ui.label(RichText::new(value).monospace().strong());
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_shown_without_source_locations() {
        assert_eq!(last_part("winit EventLoopError: os error at a/b/mod.rs:788: Failed to open"), "Failed to open");
        assert_eq!(last_part("no config found"), "no config found");
    }
}
