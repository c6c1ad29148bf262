//! A comparison with other settings on the same hand: two engines get the device's poses, and the
//! device gets the wrench of one engine.

use eframe::egui::{Align2, FontId, Rect, Stroke, Ui, pos2, vec2};
use palpus::render::Settings;

use super::history::History;
use super::overlay::Notices;
use super::run::Run;
use super::theme::thin;
use super::view3d::colour;
use crate::scene::Scene;
use crate::style::Style;

/// Size of the letters, points.
const LETTERS: f32 = 15.0;
/// Distance of the text from the edges, points.
const MARGIN: f32 = 12.0;

/// A comparison.
pub(super) struct Beside {
    /// Names of the felt and the compared settings.
    pub(super) names: [&'static str; 2],
    /// The moment with the other settings.
    pub(super) scene: Scene,
}

impl Beside {
    /// Starts a comparison with `settings`.
    ///
    /// # Errors
    ///
    /// Fails with the run's message.
    pub(super) fn begin(
        names: [&'static str; 2],
        settings: &Settings,
        scene: &Scene,
        run: &mut dyn Run,
    ) -> Result<Self, String> {
        run.compare(Some(settings))?;
        let mut scene = scene.clone();
        scene.moment = None;
        Ok(Self { names, scene })
    }

    /// Takes the results since the last frame.
    pub(super) fn take_newest(&mut self, felt: &Scene, history: &mut History, run: &mut dyn Run) {
        self.scene.force_scale = felt.force_scale;
        self.scene.torque_scale = felt.torque_scale;
        for (body, felt) in self.scene.bodies.iter_mut().zip(&felt.bodies) {
            (body.look, body.colour) = (felt.look, felt.colour);
        }
        if let Some(moment) = run.compared(&mut |tick| history.push_compared(tick)) {
            self.scene.pose_probes(moment);
            match &mut self.scene.moment {
                Some(shown) => shown.clone_from(moment),
                none => *none = Some(moment.clone()),
            }
        }
    }
}

/// Ends the comparison.
pub(super) fn end(run: &mut dyn Run, history: &mut History, notices: &Notices) {
    notices.check(run.compare(None));
    history.clear_compared();
}

/// Writes the name of the settings above each half.
pub(super) fn title(ui: &Ui, rect: Rect, name: &str, is_felt: bool, style: &Style) {
    let colours = style.theme.colours();
    let painter = ui.painter_at(rect);
    let (rgb, short, rest) = if is_felt {
        (colours.force, format!("A: {name}"), ", felt")
    } else {
        (colours.compared, format!("B: {name}"), ", same hand, not sent to the device")
    };
    let galley = |words: String| painter.layout_no_wrap(words, FontId::proportional(LETTERS), colour(rgb));
    let long = galley(format!("{short}{rest}"));
    // A second line would cover the scene.
    let words = if long.size().x <= rect.width() - 2.0 * MARGIN { long } else { galley(short) };
    let at = Align2::CENTER_TOP.anchor_size(pos2(rect.center().x, rect.top() + MARGIN), words.size());
    painter.rect_filled(at.expand2(vec2(8.0, 3.0)), 5.0, thin(colours.below, 0.8));
    painter.galley(at.min, words, colour(rgb));
    if !is_felt {
        painter.vline(rect.left(), rect.y_range(), Stroke::new(1.0, thin(colours.faint, 0.6)));
    }
}
