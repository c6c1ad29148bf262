//! What the makers' libraries see.

use std::sync::mpsc;
use std::time::Duration;

use palpus_device::{Finding, HapticDevice};

use crate::error::DriverError;
use crate::force_dimension::{self, ForceDimension, ForceDimensionOptions};
use crate::library::{Known, Place};
use crate::open_haptics::{self, OpenHaptics};

const FORCE_DIMENSION: (&str, &str) = ("force-dimension", "omega, delta, sigma, lambda, Falcon");
const OPEN_HAPTICS: (&str, &str) = ("openhaptics", "Touch, Touch X, Phantom");
/// Together they take no longer than people like to wait.
const MOST: Duration = Duration::from_millis(500);

/// What is there of Force Dimension's and of OpenHaptics', one finding or more each. Devices are opened for a moment and give no
/// force.
pub fn look() -> Vec<Finding> {
    // Libraries of others may hang. Then the thread is left to its fate, and the program says so.
    let force_dimension = within(FORCE_DIMENSION, force_dimension);
    let open_haptics = within(OPEN_HAPTICS, open_haptics);
    vec![force_dimension, open_haptics]
}

fn within(backend: (&'static str, &'static str), look: fn() -> Finding) -> Finding {
    let (answer, answered) = mpsc::channel();
    let thread = std::thread::Builder::new().name(backend.0.to_owned());
    // Whoever has waited long enough hears no answer any more.
    let started = thread.spawn(move || drop(answer.send(look())));
    let hangs = || {
        let mend = "unplug the device, plug it in again, and try once more";
        Finding::missing(
            backend.0,
            backend.1,
            "a device behind the maker's library",
            "the library does not answer",
            mend,
        )
    };
    started.ok().and_then(|_| answered.recv_timeout(MOST).ok()).unwrap_or_else(hangs)
}

fn force_dimension() -> Finding {
    match ForceDimension::open(&ForceDimensionOptions::default()) {
        Ok(device) => {
            let note = if device.has_watchdog() {
                "takes its force away by itself when the program stops answering"
            } else {
                "has no watchdog of its own"
            };
            Finding::found(FORCE_DIMENSION.0, FORCE_DIMENSION.0, device.spec().clone(), device.rate_hz(), note)
        }
        Err(error) => missing(FORCE_DIMENSION, &force_dimension::LIBRARY, &error),
    }
}

fn open_haptics() -> Finding {
    match OpenHaptics::look(&Place::Usual) {
        Ok(spec) => {
            let note = "HDAPI's own thread drives it";
            Finding::found(OPEN_HAPTICS.0, OPEN_HAPTICS.0, spec, open_haptics::RATE_HZ, note)
        }
        Err(error) => missing(OPEN_HAPTICS, &open_haptics::LIBRARY, &error),
    }
}

fn missing((backend, name): (&'static str, &'static str), library: &Known, error: &DriverError) -> Finding {
    let (looked_for, why) = match error {
        DriverError::LibraryMissing { looked_for, .. } => {
            (looked_for.clone(), "the maker's library is not there".into())
        }
        other => (library.looked_for(), other.why()),
    };
    Finding::missing(backend, name, looked_for, why, error.mend())
}
