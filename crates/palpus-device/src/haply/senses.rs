//! From the service's samples to states of the device.

use std::time::Instant;

use glam::DQuat;
use palpus::algebra::{Pose, Twist};

use super::grip::GripFilter;
use super::message::Sample;
use crate::device::DeviceState;

/// s without an orientation after which the force is withheld.
const GRIP_QUIET_TIME: f64 = 0.05;
/// s without an orientation after which the grip is lost.
const GRIP_LOST_TIME: f64 = 0.25;

/// Earlier samples.
pub(super) struct Senses {
    origin: Instant,
    filter: Option<GripFilter>,
    rotation: DQuat,
    /// There is a grip.
    gripped: bool,
    /// When the grip was heard last, or said that it is not ready, s.
    heard: f64,
    buttons: Pressed,
}

impl Senses {
    /// Nothing was heard so far, of an arm with a grip or without.
    pub(super) fn new(gripped: bool) -> Self {
        let (origin, rotation, buttons) = (Instant::now(), DQuat::IDENTITY, Pressed::default());
        Self { origin, filter: None, rotation, gripped, heard: 0.0, buttons }
    }

    /// s since the beginning.
    pub(super) fn time(&self, now: Instant) -> f64 {
        now.duration_since(self.origin).as_secs_f64()
    }

    /// The state that `sample` tells.
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
            // The grip still answers, so it is not lost, but its orientation is old. Its buttons
            // count as released, so that a dead-man's button lets go.
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

    /// True if the grip has not been heard for too long.
    pub(super) fn is_deaf(&self, now: Instant) -> bool {
        self.gripped && self.time(now) - self.heard > GRIP_LOST_TIME
    }
}

/// Buttons as the loop sees them. A button that is down when the grip is heard first, or again
/// after sleep, counts only once it has been released: it was not pressed to ask for forces.
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
    fn a_button_that_is_held_from_the_start_is_not_pressed() {
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
