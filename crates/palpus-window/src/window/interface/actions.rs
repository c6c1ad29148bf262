//! The effects of keys and buttons: step 2 of a frame.

use eframe::egui;
use glam::DVec3;
use palpus::algebra::Pose;

use super::Interface;
use crate::window::beside::{self, Beside};
use crate::window::keys::SceneAction;
use crate::window::opening::Opening;
use crate::window::run::Start;
use crate::window::run_keys::Action;
use crate::window::shot;

impl Interface<'_> {
    /// Carries out an action of a key or a button (step 2).
    pub(super) fn act(&mut self, context: &egui::Context, action: Action) {
        match action {
            Action::Pause => {
                let paused = !self.run.is_paused();
                self.notices.check(self.run.pause(paused));
            }
            Action::Tick => {
                if self.run.is_paused() || self.notices.check(self.run.pause(true)).is_some() {
                    self.run.step(1);
                }
            }
            Action::Record => self.record(),
            Action::Restart => {
                self.notices.check(self.run.restart(None));
            }
            Action::Jump => {
                let aim = self.hand.aim(&self.scene);
                let start = self.start_at(aim, false);
                self.jump = self.notices.check(self.run.restart(Some(start))).map(|()| aim);
            }
            Action::LeadOut if self.way_out.is_none() => {
                self.notices.tell("the probe does not overlap anything");
            }
            Action::LeadOut => {
                let start = self.start_at(self.hand.aim(&self.scene), true);
                self.notices.check(self.run.restart(Some(start)));
            }
            Action::Save => {
                if let Some(file) = self.notices.check(self.run.save()) {
                    self.notices.tell(format!("saved: palpus run {}", file.display()));
                }
            }
            Action::Handles => {
                self.handles.moves = self.handles.moves.next();
                self.notices.tell(self.handles.moves.words());
            }
            Action::Side => self.side = Some(!self.has_side(context)),
            Action::Open => self.opening = Some(Opening::new(self.run)),
            Action::Script if self.help => self.help = false,
            Action::Script => self.hand.give_back(self.run),
            Action::Freeze => {
                self.frozen ^= true;
                self.plots.cursor = None;
            }
            Action::Beside => self.turn_beside(),
            Action::Keep => {
                self.feel.keep(&self.run.settings());
                self.notices.tell("kept: Y compares with these settings");
            }
            Action::PlotKind => self.plots.kind = self.plots.kind.next(),
            Action::Contacts => self.style.contacts ^= true,
            Action::Clusters => self.style.clusters ^= true,
            Action::Wrench => self.style.wrench ^= true,
            Action::Anchors => self.style.anchors ^= true,
            Action::Glass => self.scene.turn_glass(),
            Action::Scene(action) => self.act_on_scene(context, action),
            of_settings => {
                self.notices.check(self.feel.act(of_settings, self.run));
            }
        }
    }

    fn start_at(&self, probe: Pose, lead_out: bool) -> Start {
        Start { probe: Some(probe), grip_a: Some(self.run.settings().grip_a), lead_out }
    }

    fn act_on_scene(&mut self, context: &egui::Context, action: SceneAction) {
        match action {
            SceneAction::Picture => self.picture(context),
            SceneAction::Keys => self.help ^= true,
            of_scene => self.view.act(context, of_scene, &mut self.scene, &mut self.style),
        }
    }

    fn record(&mut self) {
        let on = self.run.recording().is_none();
        if let Some(file) = self.notices.check(self.run.record(on)) {
            let what = if on { "recording into" } else { "recorded:" };
            self.notices.tell(format!("{what} {}", file.display()));
        }
    }

    /// Saves a picture of the whole window.
    fn picture(&self, context: &egui::Context) {
        let notices = self.notices.clone();
        context.request_screenshot(move |image| {
            if let Some(file) = notices.check(shot::keep(&image)) {
                notices.tell(format!("written: {}", file.display()));
            }
        });
    }

    /// Turns the comparison of settings on or off.
    fn turn_beside(&mut self) {
        if self.beside.take().is_some() {
            beside::end(self.run, &mut self.history, &self.notices);
            self.view.widen();
            return;
        }
        let (names, settings) = self.feel.other(&self.run.settings());
        let begun = Beside::begin(names, &settings, &self.scene, self.run);
        self.beside = self.notices.check(begun);
        self.view.widen();
    }

    /// Restarts the scene with the grip at this displacement from its old position, world, m.
    pub(super) fn move_grip(&mut self, way: DVec3) {
        let Some(probe) = self.scene.bodies.first() else { return };
        let grip_a = self.run.settings().grip_a + probe.pose.inverse().vector(way);
        if way != DVec3::ZERO {
            self.notices.check(self.run.restart(Some(Start { probe: None, grip_a: Some(grip_a), lead_out: false })));
        }
    }
}
