//! Devices that the makers' libraries find.

use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant};

use palpus_device::{Finding, HapticDevice};

use crate::error::DriverError;
use crate::force_dimension::{self, ForceDimension, ForceDimensionOptions};
use crate::library::{Known, Place};
use crate::open_haptics::{self, OpenHaptics};

const FORCE_DIMENSION: (&str, &str) = ("force-dimension", "omega, delta, sigma, lambda, Falcon");
const OPEN_HAPTICS: (&str, &str) = ("openhaptics", "Touch, Touch X, Phantom");
/// Timeout of the search. A connected device usually answers within this time.
const MOST: Duration = Duration::from_secs(1);

/// Returns one finding for the devices of Force Dimension and one for those of OpenHaptics. Opens
/// devices for a short time, without force.
pub fn look() -> Vec<Finding> {
    let begun = Instant::now();
    let asked = [ask(FORCE_DIMENSION, force_dimension), ask(OPEN_HAPTICS, open_haptics)];
    let answer = |(backend, answered): ((&'static str, &'static str), Receiver<Finding>)| {
        let left = MOST.saturating_sub(begun.elapsed());
        answered.recv_timeout(left).unwrap_or_else(|_| {
            let mend = format!("try palpus run --device {}, or unplug the device and plug it in again", backend.0);
            let why = "the library was found, but does not answer within a second";
            Finding::missing(backend.0, backend.1, "a device behind the maker's library", why, mend)
        })
    };
    asked.into_iter().map(answer).collect()
}

/// Searches on a separate thread. The thread is abandoned if a maker's library hangs.
fn ask(
    backend: (&'static str, &'static str),
    look: fn() -> Finding,
) -> ((&'static str, &'static str), Receiver<Finding>) {
    let (answer, answered) = mpsc::channel();
    let thread = std::thread::Builder::new().name(backend.0.to_owned());
    // After the timeout the receiver no longer exists. If the thread cannot be started, there is no
    // answer.
    drop(thread.spawn(move || drop(answer.send(look()))));
    (backend, answered)
}

fn force_dimension() -> Finding {
    match ForceDimension::open(&ForceDimensionOptions::default()) {
        Ok(device) => {
            let note = if device.has_watchdog() {
                "switches off its force by itself if the program stops"
            } else {
                "has no watchdog in the device"
            };
            Finding::found(FORCE_DIMENSION.0, FORCE_DIMENSION.0, device.spec().clone(), device.rate_hz(), note)
        }
        Err(error) => missing(FORCE_DIMENSION, &force_dimension::LIBRARY, &error),
    }
}

fn open_haptics() -> Finding {
    match OpenHaptics::look(&Place::Usual) {
        Ok(spec) => {
            let note = "is driven by HDAPI's thread";
            Finding::found(OPEN_HAPTICS.0, OPEN_HAPTICS.0, spec, open_haptics::RATE_HZ, note)
        }
        Err(error) => missing(OPEN_HAPTICS, &open_haptics::LIBRARY, &error),
    }
}

fn missing((backend, name): (&'static str, &'static str), library: &Known, error: &DriverError) -> Finding {
    let (looked_for, why) = match error {
        DriverError::LibraryMissing { looked_for, .. } => (looked_for.clone(), "the maker's library is missing".into()),
        other => (library.looked_for(), other.why()),
    };
    Finding::missing(backend, name, looked_for, why, error.mend())
}
