//! Descriptions of HDAPI's errors, each with advice.

/// True if the driver reduced or removed the force and continues.
pub(super) fn is_of_force(code: u32) -> bool {
    (0x0200..=0x0204).contains(&code)
}

/// True if the driver applied no force at all in that turn.
pub(super) fn gives_none(code: u32) -> bool {
    is_of_force(code) && code != WARM_MOTORS
}

/// The motors are too warm for the commanded force.
pub(super) const WARM_MOTORS: u32 = 0x0200;

/// Returns the meaning of an error, and advice.
pub(super) fn in_words(code: u32) -> (String, &'static str) {
    let (what, mend) = match code {
        WARM_MOTORS => ("the motors are warm", "let the device rest for several minutes"),
        0x0201 => ("the commanded force is more than the device can apply", "lower the scene's force limit"),
        0x0202 => ("the force changed faster than the driver allows", "lower the scene's stiffness"),
        0x0203 => ("the stylus moved faster than the driver allows", "move more slowly, or start again"),
        0x0204 => ("the driver refuses the force", "start again; the maker's Touch Diagnostic has details"),
        0x0300 => (
            "the driver found no device that answers, or the device reports a fault",
            "check the cable and power; pair it with the maker's Touch Setup",
        ),
        0x0301 => ("the device is in use", "close other programs that use it"),
        0x0302 => (
            "the connection to the device failed",
            "check the cable and power; on Linux also check your permission for its port (/dev/ttyACM*, group dialout)",
        ),
        0x0303 => ("the device's connection is not set up", "pair it with the maker's Touch Setup"),
        0x0304 => ("HDAPI's timer failed", "start again; close programs that use all processors"),
        0x0400..=0x0402 => ("HDAPI lost its frame", "start again; please report this"),
        0x0500 | 0x0501 => ("HDAPI's scheduler refused the loop", "start again; please report this"),
        0x0600 => (
            "OpenHaptics has no valid licence",
            "install the licence, or the free Developer Edition of OpenHaptics for education and personal use",
        ),
        _ => ("HDAPI reports an error", "look the code up in the OpenHaptics reference"),
    };
    (format!("{what} (HDAPI error 0x{code:04x})"), mend)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_error_text_has_its_code() {
        for code in [0x200, 0x201, 0x202, 0x203, 0x204, 0x300, 0x302, 0x304, 0x402, 0x500, 0x600, 0x999] {
            let (what, mend) = in_words(code);
            assert!(what.contains(&format!("0x{code:04x}")) && !mend.is_empty());
        }
        assert!(is_of_force(0x203) && !is_of_force(0x300) && !is_of_force(0x100));
    }
}
