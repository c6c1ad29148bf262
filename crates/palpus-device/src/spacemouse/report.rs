//! Reports of a SpaceMouse.
//!
//! Report 1 has three signed 16-bit numbers, little-endian: the translation of the cap. Newer
//! devices and receivers append three more numbers: the rotation of the cap. Report 2 has the three
//! numbers of the rotation alone. Report 3 has the buttons, one bit each. Full deflection is 350.
//! The device's axes are x right, y towards the user, z down, which is half a turn about x from the
//! axes of palpus.

use glam::DVec3;

/// Size of the read buffer, bytes. The three reports fit into the buffer; the kernel truncates
/// longer reports.
pub(super) const LONGEST: usize = 64;

/// Reported number at full deflection. Some devices go a little beyond.
const FULL: f64 = 350.0;

/// Deflection of the cap, and pressed buttons.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cap {
    /// Translation as fractions of the full deflection, in the axes of palpus.
    pub(super) push: DVec3,
    /// Rotation as fractions of the full deflection, in the axes of palpus.
    pub(super) turn: DVec3,
    /// Pressed buttons, one bit each.
    pub(super) buttons: u32,
}

impl Cap {
    /// Takes a report. Returns true if the report belongs to the cap or its buttons.
    pub(super) fn take(&mut self, report: &[u8]) -> bool {
        match report {
            [1, axes @ ..] if axes.len() >= 6 => {
                self.push = three(axes);
                if axes.len() >= 12 {
                    self.turn = three(&axes[6..]);
                }
                true
            }
            [2, axes @ ..] if axes.len() >= 6 => {
                self.turn = three(axes);
                true
            }
            [3, bits @ ..] if !bits.is_empty() => {
                self.buttons =
                    bits.iter().take(4).enumerate().fold(0, |all, (k, byte)| all | u32::from(*byte) << (8 * k));
                true
            }
            _ => false,
        }
    }

    /// Sets the deflection to zero; the buttons stay as they are.
    pub(super) fn let_go(&mut self) {
        (self.push, self.turn) = (DVec3::ZERO, DVec3::ZERO);
    }
}

/// Converts three numbers to fractions of the full deflection, in the axes of palpus.
fn three(bytes: &[u8]) -> DVec3 {
    let share = |k: usize| (f64::from(i16::from_le_bytes([bytes[2 * k], bytes[2 * k + 1]])) / FULL).clamp(-1.0, 1.0);
    DVec3::new(share(0), -share(1), -share(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cap(reports: &[&[u8]]) -> Cap {
        let mut cap = Cap::default();
        for report in reports {
            assert!(cap.take(report), "{report:?}");
        }
        cap
    }

    #[test]
    fn three_axis_reports_are_read() {
        // Translation 350, -350, 175; rotation 0, 70, -350.
        let cap = cap(&[&[1, 0x5e, 0x01, 0xa2, 0xfe, 0xaf, 0x00], &[2, 0, 0, 70, 0, 0xa2, 0xfe]]);
        assert_eq!((cap.push, cap.turn), (DVec3::new(1.0, 1.0, -0.5), DVec3::new(0.0, -0.2, 1.0)));
    }

    #[test]
    fn six_axis_report_is_read() {
        let cap = cap(&[&[1, 35, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xdd, 0xff]]);
        assert_eq!((cap.push, cap.turn), (DVec3::new(0.1, 0.0, 0.0), DVec3::new(0.0, 0.0, 0.1)));
    }

    #[test]
    fn larger_deflection_counts_as_full() {
        let cap = cap(&[&[1, 0xff, 0x7f, 0x00, 0x80, 0, 0]]);
        assert_eq!(cap.push, DVec3::new(1.0, 1.0, 0.0));
    }

    #[test]
    fn buttons_are_read_bit_by_bit() {
        assert_eq!(cap(&[&[3, 0b11]]).buttons, 0b11);
        assert_eq!(cap(&[&[3, 1, 0, 0, 0x80, 0xff]]).buttons, 0x8000_0001);
    }

    #[test]
    fn truncated_or_unknown_report_is_ignored() {
        let mut cap = Cap::default();
        for report in [&[][..], &[1], &[1, 1, 1, 1, 1, 1], &[2, 9], &[3], &[23, 55], &[0; 13], &[255; 64]] {
            assert!(!cap.take(report), "{report:?}");
        }
        assert_eq!(cap, Cap::default());
    }
}
