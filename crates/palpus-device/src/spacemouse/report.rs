//! Reports of a SpaceMouse.
//!
//! Report 1: three signed 16-bit numbers, little-endian, of how far the cap is pushed; newer
//! devices and receivers put three more behind them, of how far it is turned. Report 2: those three
//! by themselves. Report 3: buttons, a bit each. Full deflection is 350. The device's axes are x
//! right, y towards the user, z down: half a turn about x from palpus's.

use glam::DVec3;

/// Bytes of the longest report that is read; longer ones are cut by the kernel, and none of the
/// three is as long.
pub(super) const LONGEST: usize = 64;

/// A device's number at full deflection. Some go a little beyond.
const FULL: f64 = 350.0;

/// How the cap is held.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cap {
    /// By shares of the full deflection, in palpus's axes.
    pub(super) push: DVec3,
    /// Likewise.
    pub(super) turn: DVec3,
    /// A bit each.
    pub(super) buttons: u32,
}

impl Cap {
    /// True if `report` was one of the cap's.
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

    /// At rest; the buttons stay as they are.
    pub(super) fn let_go(&mut self) {
        (self.push, self.turn) = (DVec3::ZERO, DVec3::ZERO);
    }
}

/// Three numbers as shares, from the device's axes to palpus's.
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
    fn reports_of_three_axes_each() {
        // x 350, y -350, z 175; turned 0, 70, -350.
        let cap = cap(&[&[1, 0x5e, 0x01, 0xa2, 0xfe, 0xaf, 0x00], &[2, 0, 0, 70, 0, 0xa2, 0xfe]]);
        assert_eq!((cap.push, cap.turn), (DVec3::new(1.0, 1.0, -0.5), DVec3::new(0.0, -0.2, 1.0)));
    }

    #[test]
    fn a_report_of_six_axes() {
        let cap = cap(&[&[1, 35, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xdd, 0xff]]);
        assert_eq!((cap.push, cap.turn), (DVec3::new(0.1, 0.0, 0.0), DVec3::new(0.0, 0.0, 0.1)));
    }

    #[test]
    fn beyond_the_full_deflection_is_full() {
        let cap = cap(&[&[1, 0xff, 0x7f, 0x00, 0x80, 0, 0]]);
        assert_eq!(cap.push, DVec3::new(1.0, 1.0, 0.0));
    }

    #[test]
    fn buttons_by_bit() {
        assert_eq!(cap(&[&[3, 0b11]]).buttons, 0b11);
        assert_eq!(cap(&[&[3, 1, 0, 0, 0x80, 0xff]]).buttons, 0x8000_0001);
    }

    #[test]
    fn what_is_cut_off_or_something_else_is_none() {
        let mut cap = Cap::default();
        for report in [&[][..], &[1], &[1, 1, 1, 1, 1, 1], &[2, 9], &[3], &[23, 55], &[0; 13], &[255; 64]] {
            assert!(!cap.take(report), "{report:?}");
        }
        assert_eq!(cap, Cap::default());
    }
}
