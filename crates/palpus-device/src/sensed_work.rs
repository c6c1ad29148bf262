//! The work of the written wrenches on a grip, from the motion that its encoders sense.
//!
//! An encoder reports motion late and in whole steps, and the wrench reacts to each step. The
//! wrench that acts when a step is sensed is therefore not the wrench under which the grip moved.
//! Force times step is wrong by half the stiffness times the squared step, always with the same
//! sign: 0.45 µJ per step of 0.03 mm at 1 kN/m. In seconds of sliding this adds up to some 100 µJ,
//! while the true work is negative. The work is therefore computed in these steps in each tick, for
//! each of the six axes:
//!
//! 1. *Travel* is the sensed motion whose work has not been counted yet. When a step is sensed, the
//!    grip is near the border between two steps: half a step short of the sensed position, plus
//!    half of its motion in a tick. So a grip that rests on a border has not moved, though its
//!    sensed position alternates.
//! 2. *Count* the work of the travel up to that border once [`SPAN`] has passed or the travel is
//!    [`MANY`] steps. The load is the mean since the last count, since the grip moved in that time.
//!    After a rest, older loads have less weight.
//! 3. *Fast*: motion of at least [`FAST`] steps in a tick is counted at once, with the load that
//!    acted in this tick. If the step is 0 (a sensor without steps, or an unknown step), every
//!    tick is counted at once.

use glam::DVec3;
use palpus::algebra::{Pose, Wrench, rotation_between};

use crate::acting::Acting;
use crate::device::DeviceSpec;

/// Shortest time over which a motion of few steps is counted, s. At 20 mm/s this time covers
/// several steps of 0.03 mm. The time is short compared with the period of a limit cycle.
const SPAN: f64 = 3.5e-3;
/// Age of a load, s, from which it counts with half its weight.
const MEMORY: f64 = 50e-3;
/// Number of encoder steps in one tick from which the motion is fast, so that it is counted at
/// once.
const FAST: f64 = 2.0;
/// Number of encoder steps of travel from which the travel is counted before [`SPAN`] has passed.
const MANY: f64 = 2.4;

/// Computes the work of the written wrenches from sensed poses; the module describes the method.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SensedWork {
    acting: Acting,
    pose: Option<Pose>,
    /// Translation along x, y, z, and rotation about x, y, z.
    axes: [[Axis; 3]; 2],
    /// Smallest sensed changes of position (m) and orientation (rad).
    steps: [f64; 2],
}

/// Motion and load of one axis since the last count.
#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    /// Motion that has not been counted yet, m or rad.
    travel: f64,
    /// Load times time since the last count, N·s or N·m·s.
    impulse: f64,
    /// Time since the last count, s.
    time: f64,
    /// Number of ticks since the last count.
    ticks: u32,
}

impl SensedWork {
    /// Takes the `delay` from a write to its action (s), the `period` of a tick (s), and the
    /// encoder `steps` (m and rad).
    pub(crate) fn new(delay: f64, period: f64, steps: [f64; 2]) -> Self {
        Self { acting: Acting::new(delay, period), pose: None, axes: Default::default(), steps }
    }

    /// Takes the description of a device and the `period` of the loop, s.
    pub(crate) fn of(spec: &DeviceSpec, period: f64) -> Self {
        Self::new(spec.delay, period, [spec.position_step, spec.angle_step])
    }

    /// Takes the grip's new `pose`, reached in `elapsed` s. Returns the work counted in this tick
    /// by forces and by torques, J.
    pub(crate) fn moved_to(&mut self, pose: &Pose, elapsed: f64) -> [f64; 2] {
        let Wrench { force, torque } = self.acting.over(elapsed);
        let Some(last) = self.pose.replace(*pose) else { return [0.0; 2] };
        let moved = pose.translation - last.translation;
        let turned = rotation_between(last.rotation, pose.rotation);
        let [translation, rotation] = &mut self.axes;
        [
            count(translation, moved, force, elapsed, self.steps[0]),
            count(rotation, turned, torque, elapsed, self.steps[1]),
        ]
    }

    /// Stores the wrench written in this tick.
    pub(crate) fn write(&mut self, wrench: &Wrench) {
        self.acting.write(wrench);
    }

    /// Starts again: no wrench was written, and the grip has not moved.
    pub(crate) fn clear(&mut self) {
        self.acting.clear();
        self.pose = None;
        self.axes = Default::default();
    }
}

/// Counts the work along three axes and returns it, J.
fn count(axes: &mut [Axis; 3], moved: DVec3, load: DVec3, elapsed: f64, step: f64) -> f64 {
    // Ignores a non-finite jump.
    if !(moved.is_finite() && load.is_finite() && elapsed.is_finite()) {
        return 0.0;
    }
    (0..3).map(|k| axes[k].count(moved[k], load[k], elapsed, step)).sum()
}

impl Axis {
    fn count(&mut self, moved: f64, load: f64, elapsed: f64, step: f64) -> f64 {
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

    /// Returns the work of a spring of 1 kN/m between 0 and the sensed position of a grip whose
    /// true position is `place(t)`: counted and true, J.
    fn spring(place: impl Fn(f64) -> f64, seconds: f64, step: f64) -> [f64; 2] {
        let mut work = SensedWork::new(0.0, TICK, [step, 0.0]);
        let (mut counted, mut done) = (0.0, 0.0);
        let mut last: Option<(f64, f64)> = None;
        for k in 0..(seconds / TICK) as u32 {
            let x = place(f64::from(k) * TICK);
            let sensed = if step > 0.0 { (x / step).round() * step } else { x };
            counted += work.moved_to(&Pose::from_translation(DVec3::X * sensed), TICK)[0];
            if let Some((before, force)) = last {
                done += force * (x - before);
            }
            let force = -1000.0 * sensed;
            work.write(&Wrench { force: DVec3::X * force, torque: DVec3::ZERO });
            last = Some((x, force));
        }
        [counted, done]
    }

    #[test]
    fn slow_back_and_forth_motion_is_counted_within_a_step() {
        // The grip moves 2 mm (67 steps) in each direction, at 2 to 40 mm/s.
        for speed in [2e-3, 10e-3, 40e-3] {
            let turn = 2e-3 / speed;
            let place = |t: f64| 2e-3 - ((t / turn).rem_euclid(2.0) - 1.0).abs() * 2e-3;
            let [counted, done] = spring(place, 2.0 * turn, STEP);
            // The bound is one step times the change of the load.
            let most = STEP * 2.0;
            assert!((counted - done).abs() < most, "{speed} m/s: {counted} J for {done} J");
        }
    }

    #[test]
    fn grip_on_a_step_border_does_no_work() {
        let place = |t: f64| 10.5 * STEP + 0.01 * STEP * (60.0 * t).sin();
        let [at_first, later] = [1.0, 5.0].map(|seconds| spring(place, seconds, STEP)[0]);
        // The first step is uncertain, since the grip may be anywhere in it.
        assert!(at_first == later && later.abs() < 0.6 * STEP * 0.32, "{at_first} J, {later} J");
    }

    #[test]
    fn sensor_without_steps_is_counted_in_each_tick() {
        let [counted, done] = spring(|t| 2e-3 * (300.0 * t).sin(), 1.0, 0.0);
        assert!((counted - done).abs() < 1e-12, "{counted} J for {done} J");
    }

    #[test]
    fn oscillation_of_millimetres_is_counted_correctly() {
        // At 50 Hz and 1 mm, a spring force that is held for a tick generates about 25 mJ in a
        // second.
        let [counted, done] = spring(|t| 1e-3 * (314.0 * t).sin(), 1.0, STEP);
        assert!(done > 0.01 && (counted - done).abs() < 0.1 * done, "{counted} J for {done} J");
    }
}
