//! The work that the written wrenches do on a grip, from the motion that its encoders sense.
//!
//! An encoder tells of a motion late, a whole step at once, and the wrench reacts to the step. The
//! wrench that acts when a step is seen is therefore not the one under which the grip moved, and
//! force times step is wrong by half the stiffness times the square of the step, always to the same
//! side: 0.45 µJ a step of 0.03 mm at 1 kN/m, or some 100 µJ in seconds of sliding, in which the
//! true work is less than nothing. So in each tick, for each of the six axes:
//!
//! 1. *Travel*: the sensed motion that has not been booked yet. When a step is seen the grip is at
//!    the border between two steps, half a step short of the sensed position, or beyond that by
//!    half of what it moves in a tick. So a grip that rests on a border has not moved, though its
//!    sensed position goes to and fro.
//! 2. *Book* the travel up to there, with the mean of the loads that acted since the last booking,
//!    since that is when the grip moved. This is done once [`SPAN`] has passed or the travel is
//!    [`MANY`] steps. After a rest the older loads count less and less.
//! 3. *Fast*: a tick of [`FAST`] steps is booked at once, with the load that acted in it. So is
//!    every tick where the step is 0, for sensors without steps and unknown ones.

use glam::DVec3;
use palpus::algebra::{Pose, Wrench, rotation_between};

use crate::acting::Acting;
use crate::device::DeviceSpec;

/// s: the shortest time over which a motion of few steps is booked. Long enough that at 20 mm/s
/// there are several steps of 0.03 mm in it, short beside the periods of a hum.
const SPAN: f64 = 3.5e-3;
/// s: of loads older than this, half is forgotten.
const MEMORY: f64 = 50e-3;
/// Encoder steps in one tick from which on the motion is booked tick by tick.
const FAST: f64 = 2.0;
/// Encoder steps of travel that are booked before the shortest time is over.
const MANY: f64 = 2.4;

/// See the module's outline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SensedWork {
    acting: Acting,
    pose: Option<Pose>,
    /// Translation and rotation along x, y and z each.
    axes: [[Axis; 3]; 2],
    /// m and rad: smallest sensed changes.
    steps: [f64; 2],
}

#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    /// m or rad, not booked yet.
    travel: f64,
    /// N·s or N·m·s, since the last booking.
    impulse: f64,
    /// s, likewise.
    time: f64,
    /// Likewise.
    ticks: u32,
}

impl SensedWork {
    /// For wrenches that act `delay` s after they were written, in ticks of `period` s, and
    /// encoders of these `steps` (m and rad).
    pub(crate) fn new(delay: f64, period: f64, steps: [f64; 2]) -> Self {
        Self { acting: Acting::new(delay, period), pose: None, axes: Default::default(), steps }
    }

    /// For the grip of a device in a loop of this `period`, s.
    pub(crate) fn of(spec: &DeviceSpec, period: f64) -> Self {
        Self::new(spec.delay, period, [spec.position_step, spec.angle_step])
    }

    /// The grip has come to `pose` in `elapsed` s; returns the work that is booked now, J, by
    /// forces and by torques.
    pub(crate) fn moved_to(&mut self, pose: &Pose, elapsed: f64) -> [f64; 2] {
        let Wrench { force, torque } = self.acting.over(elapsed);
        let Some(last) = self.pose.replace(*pose) else { return [0.0; 2] };
        let moved = pose.translation - last.translation;
        let turned = rotation_between(last.rotation, pose.rotation);
        let [translation, rotation] = &mut self.axes;
        [
            book(translation, moved, force, elapsed, self.steps[0]),
            book(rotation, turned, torque, elapsed, self.steps[1]),
        ]
    }

    /// Once a tick: what was written.
    pub(crate) fn write(&mut self, wrench: &Wrench) {
        self.acting.write(wrench);
    }

    /// Nothing was written, and nothing has moved.
    pub(crate) fn forget(&mut self) {
        self.acting.forget();
        self.pose = None;
        self.axes = Default::default();
    }
}

/// Work along three axes.
fn book(axes: &mut [Axis; 3], moved: DVec3, load: DVec3, elapsed: f64, step: f64) -> f64 {
    // A jump that is no number is not remembered.
    if !(moved.is_finite() && load.is_finite() && elapsed.is_finite()) {
        return 0.0;
    }
    (0..3).map(|k| axes[k].book(moved[k], load[k], elapsed, step)).sum()
}

impl Axis {
    fn book(&mut self, moved: f64, load: f64, elapsed: f64, step: f64) -> f64 {
        self.travel += moved;
        self.impulse += load * elapsed;
        self.time += elapsed;
        self.ticks = self.ticks.saturating_add(1);
        let passed = (self.travel.abs() - 0.5 * step).max(0.0);
        let within = (0.5 * passed / f64::from(self.ticks)).min(0.5 * step);
        let certain = if passed > 0.0 { (passed + within).copysign(self.travel) } else { 0.0 };
        let is_fast = moved.abs() >= FAST * step;
        let work = if is_fast {
            certain * load
        } else if certain != 0.0 && (self.time >= SPAN || passed >= MANY * step) {
            certain * (self.impulse / self.time)
        } else {
            if self.time > MEMORY {
                self.impulse *= 0.5;
                self.time *= 0.5;
            }
            return 0.0;
        };
        *self = Self { travel: self.travel - certain, ..Self::default() };
        work
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: f64 = 1e-3;
    const STEP: f64 = 0.03e-3;

    /// Work of a spring of 1 kN/m, fixed at 0 and stretched to the sensed place of a grip that is
    /// truly at `place(t)`, J: as it is booked, and as it is.
    fn spring(place: impl Fn(f64) -> f64, seconds: f64, step: f64) -> [f64; 2] {
        let mut work = SensedWork::new(0.0, TICK, [step, 0.0]);
        let (mut booked, mut done) = (0.0, 0.0);
        let mut last: Option<(f64, f64)> = None;
        for k in 0..(seconds / TICK) as u32 {
            let x = place(f64::from(k) * TICK);
            let sensed = if step > 0.0 { (x / step).round() * step } else { x };
            booked += work.moved_to(&Pose::from_translation(DVec3::X * sensed), TICK)[0];
            if let Some((before, force)) = last {
                done += force * (x - before);
            }
            let force = -1000.0 * sensed;
            work.write(&Wrench { force: DVec3::X * force, torque: DVec3::ZERO });
            last = Some((x, force));
        }
        [booked, done]
    }

    #[test]
    fn slow_motion_to_and_fro_is_booked_within_a_step() {
        // 2 mm at 2 to 40 mm/s: 67 steps each way.
        for speed in [2e-3, 10e-3, 40e-3] {
            let turn = 2e-3 / speed;
            let place = |t: f64| 2e-3 - ((t / turn).rem_euclid(2.0) - 1.0).abs() * 2e-3;
            let [booked, done] = spring(place, 2.0 * turn, STEP);
            // A step times the change of the load.
            let most = STEP * 2.0;
            assert!((booked - done).abs() < most, "{speed} m/s: {booked} J for {done} J");
        }
    }

    #[test]
    fn grip_on_the_border_of_two_steps_does_no_work() {
        let place = |t: f64| 10.5 * STEP + 0.01 * STEP * (60.0 * t).sin();
        let [at_first, later] = [1.0, 5.0].map(|seconds| spring(place, seconds, STEP)[0]);
        // At the start it is not known where in its first step the grip is.
        assert!(at_first == later && later.abs() < 0.6 * STEP * 0.32, "{at_first} J, {later} J");
    }

    #[test]
    fn sensor_without_steps_is_booked_in_each_tick() {
        let [booked, done] = spring(|t| 2e-3 * (300.0 * t).sin(), 1.0, 0.0);
        assert!((booked - done).abs() < 1e-12, "{booked} J for {done} J");
    }

    #[test]
    fn oscillation_of_millimetres_is_booked_as_it_is() {
        // 50 Hz, 1 mm: the spring is held for a tick, which gives about 25 mJ in a second.
        let [booked, done] = spring(|t| 1e-3 * (314.0 * t).sin(), 1.0, STEP);
        assert!(done > 0.01 && (booked - done).abs() < 0.1 * done, "{booked} J for {done} J");
    }
}
