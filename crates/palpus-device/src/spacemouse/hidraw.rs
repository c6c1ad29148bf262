//! SpaceMouse devices in Linux's list of HID devices.
//!
//! The kernel lists vendor, product and name in `/sys/class/hidraw/hidrawN/device/uevent`, and the
//! kind of device in the file `report_descriptor` beside it. Every user can read these files. Only
//! `/dev/hidrawN` itself needs a permission.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use super::SpaceMouseError;

/// USB vendor number of 3Dconnexion. Older devices have the vendor number of Logitech, which other
/// products share. So these devices are listed by product number.
const VENDOR: u16 = 0x256f;
const EARLIER_VENDOR: u16 = 0x046d;
const EARLIER_PRODUCTS: [u16; 11] =
    [0xc603, 0xc605, 0xc606, 0xc621, 0xc623, 0xc625, 0xc626, 0xc627, 0xc628, 0xc629, 0xc62b];
/// Start of the report descriptor of a multi-axis controller: usage page 1 (desktop), usage 8.
const SEVERAL_AXES: [u8; 4] = [0x05, 0x01, 0x09, 0x08];

/// Folder in which the kernel lists HID devices.
pub(super) const LIST: &str = "/sys/class/hidraw";

/// A connected SpaceMouse.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Plugged {
    /// Device file, such as `/dev/hidraw3`.
    pub(super) path: PathBuf,
    pub(super) name: String,
    pub(super) vendor: u16,
}

/// Returns the connected devices, sorted by device file. `list` is the kernel's list, `files` the
/// folder of the device files.
pub(super) fn plugged(list: &Path, files: &Path) -> Vec<Plugged> {
    let Ok(entries) = fs::read_dir(list) else { return Vec::new() };
    let mut found: Vec<Plugged> = entries
        .flatten()
        .filter_map(|entry| {
            let device = entry.path().join("device");
            let (vendor, product, name) = identity(&fs::read_to_string(device.join("uevent")).ok()?)?;
            let is_one = vendor == VENDOR || (vendor == EARLIER_VENDOR && EARLIER_PRODUCTS.contains(&product));
            // A receiver also has other interfaces. Without a descriptor, the reports show whether
            // this is the cap.
            let descriptor = fs::read(device.join("report_descriptor")).unwrap_or_default();
            let is_cap = descriptor.is_empty() || descriptor.starts_with(&SEVERAL_AXES);
            (is_one && is_cap).then(|| Plugged { path: files.join(entry.file_name()), name, vendor })
        })
        .collect();
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

/// Parses vendor, product and name from a `uevent` file.
fn identity(uevent: &str) -> Option<(u16, u16, String)> {
    let line = |key: &str| uevent.lines().find_map(|line| line.strip_prefix(key));
    let mut id = line("HID_ID=")?.split(':').skip(1);
    let mut number = || u16::try_from(u32::from_str_radix(id.next()?, 16).ok()?).ok();
    let (vendor, product) = (number()?, number()?);
    let name: String = line("HID_NAME=").unwrap_or("SpaceMouse").chars().filter(|c| !c.is_control()).take(64).collect();
    Some((vendor, product, name))
}

/// Opens the device at `path`, or the first connected device, for reads that do not wait. Also
/// returns the name of the device.
pub(super) fn open(path: Option<&str>) -> Result<(File, String), SpaceMouseError> {
    let plugged = plugged(Path::new(LIST), Path::new("/dev"));
    let (path, known) = match path {
        Some(path) => (PathBuf::from(path), plugged.iter().find(|device| device.path == Path::new(path))),
        None => {
            let first = plugged.first().ok_or(SpaceMouseError::None)?;
            (first.path.clone(), Some(first))
        }
    };
    let name = known.map_or_else(|| "SpaceMouse".to_owned(), |device| device.name.clone());
    let vendor = known.map_or(VENDOR, |device| device.vendor);
    match open_file(&path) {
        Ok(file) => Ok((file, name)),
        Err(error) => {
            let (path, why) = (path.display().to_string(), error.to_string());
            Err(match error.kind() {
                io::ErrorKind::PermissionDenied => SpaceMouseError::Denied { path, why, mend: rule(vendor) },
                _ => SpaceMouseError::Unusable { path, why },
            })
        }
    }
}

fn open_file(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).custom_flags(rustix::fs::OFlags::NONBLOCK.bits().cast_signed()).open(path)
}

/// Returns the shell command that adds a udev rule, so that the local user can read the device.
fn rule(vendor: u16) -> String {
    format!(
        "echo 'KERNEL==\"hidraw*\", ATTRS{{idVendor}}==\"{vendor:04x}\", TAG+=\"uaccess\"' | sudo tee /etc/udev/rules.d/70-spacemouse.rules && sudo udevadm control --reload && sudo udevadm trigger"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A list of HID devices in a temporary folder, which is deleted on drop.
    struct List(PathBuf);

    impl List {
        fn new(name: &str) -> Self {
            let folder = std::env::temp_dir().join(format!("palpus-hidraw-{name}-{}", std::process::id()));
            fs::create_dir_all(&folder).unwrap();
            Self(folder)
        }

        fn add(&self, device: &str, id: &str, name: &str, descriptor: &[u8]) {
            let folder = self.0.join(device).join("device");
            fs::create_dir_all(&folder).unwrap();
            fs::write(folder.join("uevent"), format!("DRIVER=hid-generic\nHID_ID={id}\nHID_NAME={name}\nHID_UNIQ=\n"))
                .unwrap();
            fs::write(folder.join("report_descriptor"), descriptor).unwrap();
        }
    }

    impl Drop for List {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn caps_are_distinguished_from_mice() {
        let list = List::new("mice");
        let cap = [0x05, 0x01, 0x09, 0x08, 0xa1, 0x01];
        list.add("hidraw0", "0003:0000046D:0000C077", "Logitech USB Optical Mouse", &[0x05, 0x01, 0x09, 0x02]);
        list.add("hidraw1", "0003:0000046D:0000C626", "3Dconnexion SpaceNavigator", &cap);
        list.add("hidraw2", "0003:0000256F:0000C652", "3Dconnexion Universal Receiver", &cap);
        list.add("hidraw3", "0003:0000256F:0000C652", "3Dconnexion Universal Receiver", &[0x06, 0x00, 0xff, 0x0a]);
        list.add("hidraw4", "0003:nonsense", "", &cap);
        let found = plugged(&list.0, Path::new("/dev"));
        let names: Vec<&str> = found.iter().map(|device| device.name.as_str()).collect();
        assert_eq!(names, ["3Dconnexion SpaceNavigator", "3Dconnexion Universal Receiver"]);
        assert_eq!(found[0].path, Path::new("/dev/hidraw1"));
        assert_eq!(found[1].vendor, VENDOR);
    }

    #[test]
    fn missing_list_means_no_device() {
        assert!(plugged(Path::new("/nowhere/at/all"), Path::new("/dev")).is_empty());
    }

    #[test]
    fn udev_rule_names_the_vendor() {
        assert!(rule(EARLIER_VENDOR).contains("ATTRS{idVendor}==\"046d\""));
    }

    #[test]
    fn missing_device_file_is_an_error() {
        let error = open(Some("/nowhere/hidraw0")).err().unwrap();
        assert!(matches!(error, SpaceMouseError::Unusable { .. }), "{error}");
    }
}
