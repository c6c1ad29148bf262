//! The SpaceMouse that moves the simulated hand in the window.

use std::time::{Duration, Instant};

use palpus_device::{HapticDevice, SpaceMouse, SpaceMouseError};
use palpus_window::Cap;

/// The SpaceMouse, which may be plugged in during the run.
#[derive(Default)]
pub(super) struct Caps {
    mouse: Option<SpaceMouse>,
    looked: Option<Instant>,
    unusable: Option<String>,
}

/// Interval between searches for a SpaceMouse.
const LOOK: Duration = Duration::from_secs(2);

impl Caps {
    pub(super) fn get(&mut self) -> Cap {
        if self.mouse.is_none() && self.looked.is_none_or(|looked| looked.elapsed() > LOOK) {
            self.look();
        }
        match self.mouse.as_mut().map(HapticDevice::read) {
            Some(Ok(state)) => Cap::Pushed(state.twist),
            Some(Err(_)) => {
                self.mouse = None;
                Cap::None
            }
            None => self.unusable.clone().map_or(Cap::None, Cap::Unusable),
        }
    }

    fn look(&mut self) {
        self.looked = Some(Instant::now());
        self.unusable = None;
        match SpaceMouse::open(None) {
            Ok(mouse) => self.mouse = Some(mouse),
            Err(SpaceMouseError::None | SpaceMouseError::NotHere) => {}
            Err(error) => self.unusable = Some(error.to_string()),
        }
    }
}
