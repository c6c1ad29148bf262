//! `palpus devices` lists the devices that were found and the requirements of the others. Also
//! opens the device named by `--device`.

mod conformance;
mod page;

use std::process::ExitCode;

use anyhow::{Context, bail};
use palpus::algebra::Pose;
use palpus_device::{
    BridgeAddress, BridgeDevice, BridgeOptions, DeviceSpec, HAPLY_ADDRESS, HaplyDevice, HaplyOptions, HapticDevice,
    PlacedDevice, RealTimeOptions, SpaceMouse, WallTime, self_test,
};
use palpus_drivers::{ForceDimension, ForceDimensionOptions, OpenHaptics, OpenHapticsOptions, Place};
use toml::Table;

use crate::args::DevicesArguments;
use crate::output;

pub(crate) fn devices(arguments: &DevicesArguments) -> anyhow::Result<ExitCode> {
    if let Some(address) = &arguments.conformance {
        return conformance::conformance(address, arguments.json);
    }
    let mut findings = palpus_device::look();
    findings.extend(palpus_drivers::look());
    if arguments.json {
        output::json(&page::document(&findings))?;
    } else {
        for line in page::page(&findings) {
            output::line(line);
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Lists the values of `--device`, for error messages.
pub(crate) const NAMES: &str = "sim, replay:FILE, haply[#ARM][:ws://HOST:PORT], spacemouse[:/dev/hidrawN], \
    force-dimension[#1][:LIBRARY], force-dimension-simulator[:LIBRARY], openhaptics[#NAME][:LIBRARY], \
    bridge:/path/to.sock, bridge:udp:127.0.0.1:PORT";

/// Opens and tests the hardware called `name`, and places it so that the grip starts at `start`
/// (world). `None` if `name` is not a hardware name.
///
/// `notes` gets messages for the recording. With `real_time`, threads of the device ask for
/// priority like the loop.
///
/// # Errors
///
/// Fails if the name is wrong, or the device is missing or fails its self test.
pub fn open(
    name: &str,
    start: Pose,
    real_time: bool,
    notes: &mut Vec<String>,
) -> anyhow::Result<Option<Box<dyn HapticDevice + Send>>> {
    let Wanted { kind, which, place } = Wanted::of(name);
    if which.is_some() && !matches!(kind, "haply" | "force-dimension" | "openhaptics") {
        bail!("there is only one `{kind}`; leave out the #");
    }
    let mut device: Box<dyn HapticDevice + Send> = match kind {
        "haply" => {
            let device = HaplyDevice::open(&haply(which, place, real_time)).with_context(|| refused(name))?;
            notes.extend_from_slice(device.notes());
            Box::new(device)
        }
        "spacemouse" => Box::new(SpaceMouse::open(place).with_context(|| refused(name))?),
        "force-dimension" | "force-dimension-simulator" => {
            let simulator = kind.ends_with("simulator");
            let options = ForceDimensionOptions { library: library(place), simulator, which: number(which)? };
            let device = ForceDimension::open(&options).with_context(|| refused(name))?;
            if !device.has_watchdog() {
                output::note(
                    "note: this device has no watchdog of its own; if the program is killed, it may hold its force",
                );
            }
            Box::new(device)
        }
        "openhaptics" => {
            let options = OpenHapticsOptions { library: library(place), device: which.map(str::to_owned) };
            Box::new(OpenHaptics::open(&options).with_context(|| refused(name))?)
        }
        "bridge" => {
            let address = BridgeAddress::parse(place.unwrap_or_default()).with_context(|| refused(name))?;
            let options = BridgeOptions { address, priority: above_loop(real_time) };
            let device = BridgeDevice::open(&options).with_context(|| refused(name))?;
            notes.extend_from_slice(device.notes());
            Box::new(device)
        }
        _ => return Ok(None),
    };
    let failed = || format!("the device `{name}` failed its self test");
    notes.push(self_test(&mut device, &WallTime::new()).with_context(failed)?.to_string());
    Ok(Some(Box::new(PlacedDevice::new(device, start))))
}

/// Value of `--device`: `KIND`, `KIND#WHICH`, `KIND:PLACE` or `KIND#WHICH:PLACE`.
#[derive(Debug, PartialEq)]
struct Wanted<'a> {
    kind: &'a str,
    which: Option<&'a str>,
    place: Option<&'a str>,
}

impl<'a> Wanted<'a> {
    fn of(name: &'a str) -> Self {
        let (front, place) = name.split_once(':').map_or((name, None), |(front, place)| (front, Some(place)));
        let (kind, which) = front.split_once('#').map_or((front, None), |(kind, which)| (kind, Some(which)));
        Self { kind, which, place }
    }
}

/// Returns the index (from 0) for a typed number (from 1).
fn number(which: Option<&str>) -> anyhow::Result<Option<u8>> {
    let Some(text) = which else { return Ok(None) };
    match text.parse::<u8>() {
        Ok(number @ 1..) => Ok(Some(number - 1)),
        _ => bail!("devices are counted from 1, such as force-dimension#2; `{text}` is not such a number"),
    }
}

/// Writes the device's own description into a recording's header.
pub(crate) fn recorded(notes: &[String], into: &mut Table) {
    if !notes.is_empty() {
        into.insert("device".into(), notes.to_vec().into());
    }
}

fn refused(name: &str) -> String {
    format!("the device `{name}` cannot be used; `palpus devices` gives advice")
}

fn library(place: Option<&str>) -> Place {
    place.map_or(Place::Usual, |file| Place::File(file.into()))
}

/// Returns the options of a Haply device. Only an address that the user types may be on another
/// machine.
fn haply(which: Option<&str>, place: Option<&str>, real_time: bool) -> HaplyOptions {
    HaplyOptions {
        address: place.unwrap_or(HAPLY_ADDRESS).to_owned(),
        beyond_loopback: place.is_some(),
        arm: which.map(str::to_owned),
        priority: above_loop(real_time),
    }
}

/// Returns the priority of a device's own thread: one more than the loop's, because the loop waits
/// for it.
fn above_loop(real_time: bool) -> Option<u8> {
    RealTimeOptions::default().priority.filter(|_| real_time).map(|priority| priority + 1)
}

/// Describes the axes that the device cannot sense or drive; `None` if all six axes are driven.
pub(crate) fn not_felt(spec: &DeviceSpec) -> Option<String> {
    match (spec.force_max > 0.0, spec.actuated.rotation, spec.sensed.rotation) {
        (false, ..) => Some(format!("{} gives no force: contacts are computed and counted, but not felt", spec.name)),
        (true, _, 0) => Some(format!("{} does not sense rotation: the probe keeps its orientation", spec.name)),
        (true, 0, _) => Some(format!("{} does not drive rotation: torques are not felt", spec.name)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_of_several_devices_can_be_selected() {
        let of = |name| {
            let Wanted { kind, which, place } = Wanted::of(name);
            (kind, which, place)
        };
        assert_eq!(of("haply"), ("haply", None, None));
        assert_eq!(of("haply#049D:ws://localhost:10001"), ("haply", Some("049D"), Some("ws://localhost:10001")));
        assert_eq!(of("force-dimension#2"), ("force-dimension", Some("2"), None));
        assert_eq!(of("openhaptics:/a#b/libHD.so"), ("openhaptics", None, Some("/a#b/libHD.so")));
        assert_eq!(of("openhaptics#Right Device"), ("openhaptics", Some("Right Device"), None));
        assert_eq!((number(None).unwrap(), number(Some("2")).unwrap()), (None, Some(1)));
        assert!(number(Some("0")).is_err() && number(Some("x")).is_err());
    }
}
