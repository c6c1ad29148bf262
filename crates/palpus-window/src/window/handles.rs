//! Handles at the grip: three arrows and three rings along and about the axes of the world. The
//! mouse drags them to place the probe. In the mode for the grip, there are only the arrows.
//!
//! 1. Each handle is a line on the screen ([`Handles::lines`]). The handle under the mouse is
//!    highlighted.
//! 2. A drag changes the handle's quantity by the mouse's motion along the handle, divided by the
//!    handle's own motion on the screen for a unit of this quantity.

use eframe::egui::{self, Align2, Color32, FontId, PointerButton, Pos2, Stroke, Vec2};
use glam::{DQuat, DVec3};

use super::hand::Motion;
use super::theme::thin;
use super::view3d::{Area, View3d, colour};
use crate::style::Style;

/// Length of an arrow, and distance from a handle within which the mouse grabs it, points.
const LENGTH: f64 = 78.0;
const REACH: f32 = 7.0;
/// Start of an arrow, relative to its length.
const BEGIN: f64 = 0.18;
/// Radius of a ring, relative to the length of an arrow.
const RING: f64 = 0.72;
/// Number of corners of a drawn ring.
const RING_POINTS: u32 = 48;
/// An arrow that is shorter than this on the screen (points) cannot be dragged. It points at the
/// camera, and a small drag would move the probe far.
const LEAST_SEEN: f32 = 14.0;
/// Size of the letters at the handles, points.
const LETTERS: f32 = 13.0;

/// The object that the handles move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Moves {
    /// No handles.
    #[default]
    Nothing,
    /// The probe.
    Probe,
    /// The point at which the probe is held.
    Grip,
}

impl Moves {
    /// Returns the next mode of the handles.
    pub(super) fn next(self) -> Self {
        match self {
            Self::Nothing => Self::Probe,
            Self::Probe => Self::Grip,
            Self::Grip => Self::Nothing,
        }
    }

    /// Returns the message about the mode.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Nothing => "no handles",
            Self::Probe => "handles move the probe: arrows shift it, rings turn it",
            Self::Grip => "handles move the grip: the point at which the probe is held",
        }
    }
}

/// A handle of an axis of the world, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Handle {
    Along(usize),
    About(usize),
}

/// See the module's outline.
#[derive(Default)]
pub(super) struct Handles {
    pub(super) moves: Moves,
    grabbed: Option<Handle>,
    lit: Option<Handle>,
    /// Displacement of the grip so far, world, m.
    way: DVec3,
}

/// Request of the handles in a frame.
pub(super) enum Dragged {
    /// The handles do not use the mouse.
    Nothing,
    /// A handle uses the mouse.
    Held,
    /// The probe moves by this step.
    Probe(Motion),
    /// The grip was released at this displacement, world, m.
    Grip(DVec3),
}

impl Handles {
    /// True while a handle is under the mouse or dragged.
    pub(super) fn has_mouse(&self) -> bool {
        self.grabbed.or(self.lit).is_some()
    }

    /// Processes the mouse for the handles at `pivot` (world).
    pub(super) fn act(&mut self, ui: &egui::Ui, area: &Area, view: &View3d, pivot: DVec3) -> Dragged {
        self.lit = None;
        if self.moves == Moves::Nothing {
            self.grabbed = None;
            return Dragged::Nothing;
        }
        let response = &area.response;
        let origin = ui.input(|input| input.pointer.press_origin());
        if response.drag_started_by(PointerButton::Primary)
            && let Some(handle) = origin.and_then(|at| self.under(area, view, pivot, at))
        {
            self.grabbed = Some(handle);
            self.way = DVec3::ZERO;
        }
        let Some(handle) = self.grabbed else {
            if !response.dragged() {
                self.lit = response.hover_pos().and_then(|at| self.under(area, view, pivot, at));
            }
            return Dragged::Nothing;
        };
        if !response.dragged_by(PointerButton::Primary) {
            self.grabbed = None;
            let way = std::mem::take(&mut self.way);
            return if self.moves == Moves::Grip { Dragged::Grip(way) } else { Dragged::Held };
        }
        let at = response.interact_pointer_pos().unwrap_or(area.rect.center());
        let Some(amount) = dragged(handle, area, view, pivot + self.way, at, response.drag_delta()) else {
            return Dragged::Held;
        };
        match (handle, self.moves) {
            (Handle::Along(axis), Moves::Grip) => {
                self.way += DVec3::AXES[axis] * amount;
                Dragged::Held
            }
            (Handle::Along(axis), _) => {
                Dragged::Probe(Motion { linear: DVec3::AXES[axis] * amount, turn: DQuat::IDENTITY })
            }
            (Handle::About(axis), _) => {
                Dragged::Probe(Motion { linear: DVec3::ZERO, turn: DQuat::from_axis_angle(DVec3::AXES[axis], amount) })
            }
        }
    }

    /// Returns the handles' lines on the screen. Arrows are last, so that they are in front.
    fn lines(&self, area: &Area, view: &View3d, pivot: DVec3) -> Vec<(Handle, Vec<Pos2>)> {
        let length = LENGTH * view.metres_per_point(area, pivot);
        let seen = |points: Vec<DVec3>| {
            let on_screen: Vec<Pos2> = points.iter().filter_map(|point| view.seen_at(area, *point)).collect();
            (on_screen.len() == points.len()).then_some(on_screen)
        };
        let ring = |axis: usize| {
            let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
            let at = |k: u32| {
                let (sine, cosine) = (std::f64::consts::TAU * f64::from(k) / f64::from(RING_POINTS)).sin_cos();
                pivot + (u * cosine + v * sine) * (RING * length)
            };
            seen((0..=RING_POINTS).map(at).collect()).map(|line| (Handle::About(axis), line))
        };
        let arrow = |axis: usize| {
            let along = DVec3::AXES[axis] * length;
            let line = seen(vec![pivot + along * BEGIN, pivot + along])?;
            (line[0].distance(line[1]) > LEAST_SEEN).then_some((Handle::Along(axis), line))
        };
        let rings = (0..3).filter(|_| self.moves == Moves::Probe).filter_map(ring);
        rings.chain((0..3).filter_map(arrow)).collect()
    }

    /// Returns the handle under the mouse: the nearest within reach.
    fn under(&self, area: &Area, view: &View3d, pivot: DVec3, at: Pos2) -> Option<Handle> {
        let lines = self.lines(area, view, pivot);
        let distances = lines.iter().map(|(handle, line)| (*handle, distance_to(line, at)));
        distances.filter(|(_, far)| *far < REACH).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(handle, _)| handle)
    }

    /// Draws the handles at `pivot` (world).
    pub(super) fn draw(&self, ui: &egui::Ui, area: &Area, view: &View3d, pivot: DVec3, style: &Style) {
        if self.moves == Moves::Nothing {
            return;
        }
        let colours = style.theme.colours();
        let pivot = pivot + self.way;
        let painter = ui.painter_at(area.rect);
        let halo = thin(colours.below, 0.7);
        for (handle, line) in self.lines(area, view, pivot) {
            let (Handle::Along(axis) | Handle::About(axis)) = handle;
            let is_lit = self.grabbed.or(self.lit) == Some(handle);
            let ink: Color32 = if is_lit { colour(colours.ink) } else { colour(colours.axes[axis]) };
            let stroke = Stroke::new(if is_lit { 4.0 } else { 2.5 }, ink);
            match handle {
                Handle::About(_) => {
                    painter.line(line.clone(), Stroke::new(stroke.width + 2.0, halo));
                    painter.line(line, stroke);
                }
                Handle::Along(_) => {
                    let way = line[1] - line[0];
                    painter.arrow(line[0], way, Stroke::new(stroke.width + 2.0, halo));
                    painter.arrow(line[0], way, stroke);
                    let name = ["x", "y", "z"][axis];
                    let at = line[1] + way.normalized() * LETTERS;
                    painter.text(at, Align2::CENTER_CENTER, name, FontId::proportional(LETTERS), ink);
                }
            }
        }
        if let Some(at) = view.seen_at(area, pivot) {
            painter.circle_filled(at, 5.0, colour(colours.ink));
            if self.moves == Moves::Grip {
                let font = FontId::proportional(LETTERS);
                painter.text(at + egui::vec2(9.0, 11.0), Align2::LEFT_TOP, "grip", font, colour(colours.ink));
            }
        }
    }
}

/// Returns the change of a handle at `pivot`, m or rad, while the mouse at `at` moves by `moved`.
/// `None` if the handle moves along the line of sight.
fn dragged(handle: Handle, area: &Area, view: &View3d, pivot: DVec3, at: Pos2, moved: Vec2) -> Option<f64> {
    let metres = view.metres_per_point(area, pivot);
    // A step along the handle (both ends, world), and its size (m or rad).
    let (step, amount) = match handle {
        Handle::Along(axis) => {
            let step = LENGTH * metres;
            ([pivot, pivot + DVec3::AXES[axis] * step], step)
        }
        Handle::About(axis) => {
            let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
            let on_ring = |angle: f64| pivot + (u * angle.cos() + v * angle.sin()) * (RING * LENGTH * metres);
            let angles = (0..RING_POINTS).map(|k| std::f64::consts::TAU * f64::from(k) / f64::from(RING_POINTS));
            let far = |angle: &f64| view.seen_at(area, on_ring(*angle)).map_or(f32::INFINITY, |seen| seen.distance(at));
            let angle = angles.min_by(|a, b| far(a).total_cmp(&far(b)))?;
            let step = 1.0 / f64::from(RING_POINTS);
            ([on_ring(angle), on_ring(angle + step)], step)
        }
    };
    let [Some(from), Some(to)] = step.map(|point| view.seen_at(area, point)) else { return None };
    along(to - from, moved).map(|steps| f64::from(steps) * amount)
}

/// Returns the part of the motion `moved` along `step`, in units of `step` (both on the screen);
/// `None` if `step` is not visible.
fn along(step: Vec2, moved: Vec2) -> Option<f32> {
    let square = step.length_sq();
    (square > 0.01).then(|| step.dot(moved) / square)
}

/// Returns the distance of a point to a polyline.
fn distance_to(line: &[Pos2], at: Pos2) -> f32 {
    let of_part = |part: &[Pos2]| {
        let (from, way) = (part[0], part[1] - part[0]);
        let share = if way.length_sq() > 0.0 { ((at - from).dot(way) / way.length_sq()).clamp(0.0, 1.0) } else { 0.0 };
        at.distance(from + way * share)
    };
    line.windows(2).map(of_part).fold(f32::INFINITY, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drag_counts_only_along_the_handle() {
        let step = Vec2::new(30.0, -40.0);
        assert!((along(step, step * 2.0).expect("the handle is visible") - 2.0).abs() < 1e-6);
        assert!(
            along(step, Vec2::new(40.0, 30.0)).expect("the handle is visible").abs() < 1e-6,
            "a drag across the handle must not move it"
        );
        assert_eq!(along(Vec2::ZERO, step), None);
    }

    #[test]
    fn nearest_point_of_a_line_counts() {
        let line = [Pos2::new(0.0, 0.0), Pos2::new(10.0, 0.0), Pos2::new(10.0, 10.0)];
        assert_eq!(distance_to(&line, Pos2::new(5.0, 3.0)), 3.0);
        assert_eq!(distance_to(&line, Pos2::new(14.0, 13.0)), 5.0);
    }

    #[test]
    fn handles_switch_from_probe_to_grip_to_none() {
        assert_eq!(Moves::default().next().next().next(), Moves::Nothing);
    }
}
