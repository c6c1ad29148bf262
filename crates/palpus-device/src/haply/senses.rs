//! Converts the service's samples to device states.

use std::time::Instant;

use glam::DQuat;
use palpus::algebra::{Pose, Twist};

use super::grip::GripFilter;
use super::message::Sample;
use crate::device::DeviceState;

/// Time without an orientation after which the force is withheld, s.
const GRIP_QUIET_TIME: f64 = 0.05;
/// Time without an orientation after which the grip is lost, s.
const GRIP_LOST_TIME: f64 = 0.25;

/// State of the conversion between samples.
pub(super) struct Senses {
    origin: Instant,
    filter: Option<GripFilter>,
    rotation: DQuat,
    /// True if there is a grip.
    gripped: bool,
    /// Time at which the grip last reported an orientation, or that it is not ready, s.
    heard: f64,
    buttons: Pressed,
}

impl Senses {
    /// Starts before the first sample. `gripped` is true if the arm has a grip.
    pub(super) fn new(gripped: bool) -> Self {
        let (origin, rotation, buttons) = (Instant::now(), DQuat::IDENTITY, Pressed::default());
        Self { origin, filter: None, rotation, gripped, heard: 0.0, buttons }
    }

    /// Returns the time since the start, s.
    pub(super) fn time(&self, now: Instant) -> f64 {
        now.duration_since(self.origin).as_secs_f64()
    }

    /// Converts `sample` to a device state.
    pub(super) fn state(&mut self, sample: &Sample, now: Instant) -> DeviceState {
        let time = self.time(now);
        let ready = sample.grip_trouble.is_none();
        if let Some(rotation) = sample.rotation.filter(|_| ready) {
            (self.rotation, self.heard) = (rotation, time);
        }
        if ready {
            if let Some(buttons) = sample.buttons {
                self.buttons.hear(buttons);
            }
        } else {
            // The grip still reports its status, so the grip is not lost, but its orientation is
            // old. The grip's buttons count as released, so a dead-man button disables the force.
            self.heard = time;
            self.buttons = Pressed::default();
        }
        let filter = self.filter.get_or_insert_with(|| GripFilter::new(self.rotation, time));
        let (rotation, angular) = filter.follow(self.rotation, time);
        let quiet = self.gripped && time - self.heard > GRIP_QUIET_TIME;
        DeviceState {
            pose: Pose { rotation, translation: sample.position },
            twist: Twist { angular, linear: sample.velocity },
            buttons: self.buttons.down,
            time,
            withheld: sample.trouble.is_some() || !ready || quiet,
        }
    }

    /// Returns true if the grip has not reported for too long.
    pub(super) fn is_deaf(&self, now: Instant) -> bool {
        self.gripped && self.time(now) - self.heard > GRIP_LOST_TIME
    }
}

/// Buttons as the loop sees them. A button that is already down in the first report, or in the
/// first report after a sleep, counts only after it was released. The user did not press such a
/// button to enable forces.
#[derive(Clone, Copy, Debug, Default)]
struct Pressed {
    known: bool,
    ignored: u32,
    down: u32,
}

impl Pressed {
    fn hear(&mut self, buttons: u32) {
        self.ignored = if self.known { self.ignored & buttons } else { buttons };
        self.known = true;
        self.down = buttons & !self.ignored;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn button_held_from_the_start_is_ignored() {
        let mut buttons = Pressed::default();
        let seen: Vec<u32> = [0b101, 0b101, 0b111, 0b010, 0b101]
            .into_iter()
            .map(|heard| {
                buttons.hear(heard);
                buttons.down
            })
            .collect();
        assert_eq!(seen, [0, 0, 0b010, 0b010, 0b101]);
    }
}
