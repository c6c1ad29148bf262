//! The hand in the window: mouse, keys and a SpaceMouse move the target pose at which the simulated
//! hand holds the probe.
//!
//! 1. *Mouse*: a drag that starts on the probe moves the probe in the view's plane. The wheel moves
//!    the probe nearer and farther. With the right button, Shift or Alt, the drag turns the probe
//!    about the grabbed point; with Ctrl it rolls the probe.
//! 2. *Keys*: arrows, PageUp and PageDown move the probe along the view's axes; with Ctrl they turn
//!    it about these axes.
//! 3. *SpaceMouse*: moves along and about the view's axes, with a speed that follows from the push.
//!
//! When the user first uses one of these inputs, the hand takes the probe over from the script, at
//! the device's pose. When the mouse releases the probe, the hand releases it too, so no force
//! remains. A few seconds later the script takes the probe again. A probe that was moved by keys or
//! a SpaceMouse stays in place until the user returns it to the script. The probe follows its
//! target through springs, so obstacles stop it. The drawn spring goes from the probe to its
//! target.

use std::time::{Duration, Instant};

use eframe::egui::{self, Key, PointerButton, Pos2, Stroke};
use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus_device::Guide;

use super::pick::probe_at;
use super::run::{Cap, Run};
use super::theme::thin;
use super::view3d::{Area, View3d, colour};
use crate::picture::Rgb;
use crate::scene::Scene;

/// Time after the mouse has released the probe until the script takes it again, s.
const COMES_BACK: Duration = Duration::from_secs(4);
/// Rotation of the probe for each point of the mouse, rad.
const TURN: f64 = 0.01;
/// Distance from the probe at which the mouse still grabs it, points.
const BESIDE: f64 = 9.0;
/// Speed of a key: shares of the view's height per second, and rad/s.
const KEY_SPEED: f64 = 0.22;
const KEY_TURN: f64 = 0.9;
/// Factor of both speeds with Shift.
const SLOWLY: f64 = 0.2;
/// Longest time for which a key acts in one frame, s.
const LONGEST_FRAME: f64 = 0.1;
/// Half the width of a coil of the drawn spring, points.
const COIL: f32 = 4.0;
/// Length of a coil, points.
const COIL_LENGTH: f32 = 8.0;
/// Smallest and largest number of coils.
const COILS: (f32, f32) = (2.0, 12.0);
/// Length of each straight end, as a share of the spring.
const ENDS: f32 = 0.12;
/// Number of corners of a drawn coil.
const POINTS_OF_COIL: usize = 12;
/// Length below which the spring is not drawn, points.
const LEAST_SPRING: f32 = 12.0;

/// See the module's outline.
#[derive(Default)]
pub(super) struct Hand {
    /// Action of the hand; poses place the probe, world.
    guide: Guide,
    grabbed: Option<Grab>,
    /// Time at which the mouse released the probe.
    released: Option<Instant>,
    over_probe: bool,
    /// End of the spring on the probe, in its frame.
    spring_a: DVec3,
    /// Reason why a SpaceMouse has no effect.
    cap_trouble: Option<String>,
}

#[derive(Clone, Copy)]
struct Grab {
    button: PointerButton,
    turns: bool,
}

/// Motion of the hand in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Translation, world, m.
    pub(super) linear: DVec3,
    pub(super) turn: DQuat,
}

impl Hand {
    /// True while the script does not move the probe.
    pub(super) fn holds(&self) -> bool {
        self.guide != Guide::Script
    }

    /// True while the mouse is over the probe or drags it.
    pub(super) fn touches(&self) -> bool {
        self.over_probe || self.grabbed.is_some()
    }

    /// Returns the reason why a SpaceMouse has no effect, if there is one.
    pub(super) fn cap_trouble(&self) -> Option<&str> {
        self.cap_trouble.as_deref()
    }

    /// Lets the hand follow its script again.
    pub(super) fn give_back(&mut self, run: &mut dyn Run) {
        self.grabbed = None;
        self.released = None;
        if std::mem::take(&mut self.guide) != Guide::Script {
            run.guide(Guide::Script);
        }
    }

    /// Resets the state, because another scene was loaded. No body is held.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Moves the held probe by mouse, keys and SpaceMouse. Returns true if the mouse moves the hand
    /// and not the camera in this frame. `keys`: true if the arrow keys move the hand, and not a
    /// control. `handles`: request of the handles, if they use the mouse.
    #[expect(clippy::too_many_arguments, reason = "the parts of a frame, each of another kind")]
    pub(super) fn act(
        &mut self,
        ui: &egui::Ui,
        area: &Area,
        view: &View3d,
        scene: &Scene,
        keys: bool,
        handles: Option<Option<Motion>>,
        run: &mut dyn Run,
    ) -> bool {
        if !run.can_guide() {
            return false;
        }
        let before = self.guide;
        let taken = handles.is_some() || self.mouse(ui, area, view, scene);
        if let Some(motion) = handles.flatten() {
            self.go(scene, &motion);
        }
        let [right, up, back] = view.camera().axes();
        let frame = ui.input(|input| f64::from(input.stable_dt)).min(LONGEST_FRAME);
        if let Some(motion) = keys.then(|| by_keys(ui, area, view, frame)).flatten() {
            self.go(scene, &motion);
        }
        match run.cap() {
            Cap::None => self.cap_trouble = None,
            Cap::Unusable(why) => self.cap_trouble = Some(why),
            Cap::Pushed(twist) => {
                self.cap_trouble = None;
                let along_view = |v: DVec3| right * v.x - back * v.y + up * v.z;
                let (linear, turn) = (along_view(twist.linear) * frame, along_view(twist.angular) * frame);
                if linear != DVec3::ZERO || turn != DVec3::ZERO {
                    self.go(scene, &Motion { linear, turn: DQuat::from_scaled_axis(turn) });
                }
            }
        }
        if self.released.is_some_and(|released| released.elapsed() > COMES_BACK) {
            self.give_back(run);
            return false;
        }
        if self.guide != before {
            run.guide(self.guide);
        }
        taken
    }

    fn mouse(&mut self, ui: &egui::Ui, area: &Area, view: &View3d, scene: &Scene) -> bool {
        let response = &area.response;
        let (modifiers, pressed, wheel) =
            ui.input(|input| (input.modifiers, input.pointer.press_origin(), input.smooth_scroll_delta().y));
        let on_probe = |at: Pos2| {
            let reach = |point: DVec3| BESIDE * view.metres_per_point(area, point);
            probe_at(scene, &view.ray(area, at), reach)
        };
        for button in [PointerButton::Primary, PointerButton::Secondary] {
            let begins = response.drag_started_by(button) && self.grabbed.is_none();
            if let Some(point_a) = pressed.filter(|_| begins).and_then(on_probe) {
                let turns = button == PointerButton::Secondary || modifiers.shift || modifiers.alt || modifiers.ctrl;
                self.grabbed = Some(Grab { button, turns });
                self.spring_a = point_a;
                self.released = None;
                self.guide = Guide::Held(self.held().unwrap_or_else(|| of_device(scene)));
            }
        }
        let Some(grab) = self.grabbed else {
            self.over_probe = !response.dragged() && response.hover_pos().is_some_and(|at| on_probe(at).is_some());
            return false;
        };
        if response.dragged_by(grab.button) {
            let moved = response.drag_delta();
            let (x, y) = (f64::from(moved.x), f64::from(moved.y));
            let [right, up, back] = view.camera().axes();
            let metres = view.metres_per_point(area, self.target());
            let deeper = back * (-f64::from(wheel) * metres);
            let motion = match (grab.turns, modifiers.ctrl) {
                (false, _) => Motion { linear: (right * x - up * y) * metres + deeper, turn: DQuat::IDENTITY },
                (true, false) => {
                    let turn = DQuat::from_axis_angle(up, x * TURN) * DQuat::from_axis_angle(right, y * TURN);
                    Motion { linear: deeper, turn }
                }
                (true, true) => Motion { linear: deeper, turn: DQuat::from_axis_angle(back, -x * TURN) },
            };
            self.go(scene, &motion);
        } else {
            self.let_go();
        }
        true
    }

    /// Lets the hand release the probe after the mouse has released it.
    fn let_go(&mut self) {
        self.grabbed = None;
        self.released = Some(Instant::now());
        self.guide = Guide::Released;
    }

    /// Returns the target of the probe, or its pose if the user does not move it, world.
    pub(super) fn aim(&self, scene: &Scene) -> Pose {
        self.held().unwrap_or_else(|| of_device(scene))
    }

    /// Returns the point about which the probe turns, world.
    pub(super) fn pivot(&self, scene: &Scene) -> DVec3 {
        self.held().map_or_else(|| of_device(scene).point(grip_a(scene)), |held| held.point(self.spring_a))
    }

    /// Holds the probe at a pose (its mesh's frame, world) by the grip (in its frame).
    pub(super) fn hold_at(&mut self, pose: Pose, grip_a: DVec3, run: &mut dyn Run) {
        (self.guide, self.spring_a) = (Guide::Held(pose), grip_a);
        run.guide(self.guide);
    }

    /// Returns the target of the probe, world, while it is held.
    fn held(&self) -> Option<Pose> {
        if let Guide::Held(pose) = self.guide { Some(pose) } else { None }
    }

    /// Returns the free end of the spring, world.
    fn target(&self) -> DVec3 {
        self.held().map_or(DVec3::ZERO, |held| held.point(self.spring_a))
    }

    /// Moves the held probe, starting from the device's pose if the script moved it before.
    fn go(&mut self, scene: &Scene, motion: &Motion) {
        let held = self.held().unwrap_or_else(|| {
            self.spring_a = grip_a(scene);
            of_device(scene)
        });
        self.released = None;
        let pivot = held.point(self.spring_a);
        let translation = pivot + motion.turn * (held.translation - pivot) + motion.linear;
        self.guide = Guide::Held(Pose { rotation: (motion.turn * held.rotation).normalize(), translation });
    }

    /// Draws the spring from the probe to its target.
    pub(super) fn draw(&self, ui: &egui::Ui, area: &Area, view: &View3d, scene: &Scene, ink: Rgb) {
        let (Some(held), Some(probe)) = (self.held(), scene.bodies.first()) else { return };
        let ends = [probe.pose.point(self.spring_a), held.point(self.spring_a)];
        let [Some(from), Some(to)] = ends.map(|end| view.seen_at(area, end)) else { return };
        let painter = ui.painter_at(area.rect);
        painter.circle_filled(from, 3.0, colour(ink));
        painter.circle_stroke(to, 6.0, Stroke::new(2.0, colour(ink)));
        if from.distance(to) > LEAST_SPRING {
            painter.line(spring(from, to), Stroke::new(1.6, thin(ink, 0.85)));
        }
    }
}

/// Returns the pose of the probe according to the device, world.
fn of_device(scene: &Scene) -> Pose {
    match (&scene.moment, scene.bodies.first()) {
        (Some(moment), _) => scene.moment_pose * moment.device,
        (None, Some(probe)) => probe.pose,
        (None, None) => Pose::IDENTITY,
    }
}

/// Returns the grip of the hand, in the probe's frame.
fn grip_a(scene: &Scene) -> DVec3 {
    scene.moment.as_ref().map_or(DVec3::ZERO, |moment| moment.tool.inverse().point(moment.grip))
}

fn by_keys(ui: &egui::Ui, area: &Area, view: &View3d, frame: f64) -> Option<Motion> {
    let (along, modifiers) = ui.input(|input| {
        let axis = |more, less| f64::from(u8::from(input.key_down(more))) - f64::from(u8::from(input.key_down(less)));
        let along = DVec3::new(
            axis(Key::ArrowRight, Key::ArrowLeft),
            axis(Key::ArrowUp, Key::ArrowDown),
            axis(Key::PageDown, Key::PageUp),
        );
        (along, input.modifiers)
    });
    // With Alt, these keys move the camera.
    if along == DVec3::ZERO || modifiers.alt {
        return None;
    }
    let [right, up, back] = view.camera().axes();
    let frame = if modifiers.shift { frame * SLOWLY } else { frame };
    if modifiers.ctrl {
        // Turns the probe as if its near side were pushed in this direction.
        let axis = right * -along.y + up * along.x - back * along.z;
        return Some(Motion { linear: DVec3::ZERO, turn: DQuat::from_scaled_axis(axis * KEY_TURN * frame) });
    }
    let height = view.metres_per_point(area, view.camera().target) * area.size().1;
    let linear = (right * along.x + up * along.y + back * along.z) * (height * KEY_SPEED * frame);
    Some(Motion { linear, turn: DQuat::IDENTITY })
}

/// Draws a coil between two points.
fn spring(from: Pos2, to: Pos2) -> Vec<Pos2> {
    let along = to - from;
    let across = along.normalized().rot90() * COIL;
    let coils = (along.length() / COIL_LENGTH).round().clamp(COILS.0, COILS.1);
    let waves = coils as usize * POINTS_OF_COIL;
    let coil = (0..=waves).map(|k| {
        let part = k as f32 / waves as f32;
        let sine = (part * coils * std::f32::consts::TAU).sin();
        from + along * (ENDS + (1.0 - 2.0 * ENDS) * part) + across * sine
    });
    std::iter::once(from).chain(coil).chain(std::iter::once(to)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moment::Moment;

    fn scene() -> Scene {
        let mut moment = Moment::new(1);
        moment.device = Pose::from_translation(DVec3::new(1.0, 2.0, 3.0));
        moment.tool = moment.device;
        moment.grip = DVec3::new(1.0, 2.0, 4.0);
        Scene { moment: Some(moment), moment_pose: Pose::from_translation(DVec3::X), ..Scene::default() }
    }

    #[test]
    fn hand_starts_at_the_device_and_rotates_about_the_grip() {
        let mut hand = Hand::default();
        hand.go(&scene(), &Motion { linear: DVec3::ZERO, turn: DQuat::from_rotation_x(0.5) });
        let held = hand.held().expect("the hand holds the probe");
        assert!((held.point(DVec3::Z) - DVec3::new(2.0, 2.0, 4.0)).length() < 1e-12, "the grip must not move");
        hand.go(&scene(), &Motion { linear: DVec3::Y, turn: DQuat::IDENTITY });
        let held = hand.held().expect("the hand holds the probe");
        assert!((held.point(DVec3::Z) - DVec3::new(2.0, 3.0, 4.0)).length() < 1e-12, "the grip must move");
    }

    #[test]
    fn releasing_the_mouse_releases_the_probe() {
        let mut hand = Hand::default();
        hand.go(&scene(), &Motion { linear: DVec3::Y, turn: DQuat::IDENTITY });
        hand.let_go();
        assert!(hand.guide == Guide::Released && hand.holds(), "the script must not hold the probe either");
        // When the hand takes the probe again, the probe starts at the device's new pose.
        hand.go(&scene(), &Motion { linear: DVec3::ZERO, turn: DQuat::IDENTITY });
        assert_eq!(hand.held().expect("the hand holds the probe").translation, DVec3::new(2.0, 2.0, 3.0));
    }

    #[test]
    fn drawn_spring_reaches_from_end_to_end() {
        let (from, to) = (Pos2::new(3.0, 4.0), Pos2::new(90.0, -20.0));
        let points = spring(from, to);
        assert_eq!((points[0], points[points.len() - 1]), (from, to));
    }
}
