// Numbers that the tests and a stand-in library exchange, with their indices. The tests and the
// library include this file.

pub const SLOTS: usize = 96;

// Set by the tests.
pub const DEVICES: usize = 0;
pub const READ_CODE: usize = 1;
pub const WRITE_CODE: usize = 2;
pub const OPEN_CODE: usize = 3;
pub const POWERED: usize = 4;
pub const ACTIVE_WRIST: usize = 5;
pub const X: usize = 6;
pub const BUTTONS: usize = 7;
pub const FAIL_NULL_NAME: usize = 8;
pub const INIT_ERROR: usize = 9;
pub const FRAME_ERROR: usize = 10;
pub const SCHEDULER_DEAD: usize = 11;
pub const HANG_READ_MS: usize = 12;
pub const STATED_FORCE: usize = 13;
pub const DOF: usize = 14;
pub const EXPERT_ONLY: usize = 15;
pub const NO_VELOCITY: usize = 16;
pub const OUT_OF_RESET: usize = 17;
pub const ENABLE_CODE: usize = 18;
pub const MOVING: usize = 19;
/// Cause that has switched off the force, as in word 14 of the status: 1 the button, 2 the speed
/// limit, 6 the dead-man's switch.
pub const SWITCHED_OFF: usize = 20;
/// Cause if the program or the watchdog has switched off the force.
pub const OFF_CAUSE: usize = 21;
pub const CALIBRATION: usize = 22;
pub const CALIBRATION_STYLES: usize = 23;
/// Number of calibration updates until the calibration is good. If negative, the calibration never
/// becomes good.
pub const CALIBRATION_TRIES: usize = 24;

/// If set, the device's watchdog never acts.
pub const WATCHDOG_SLEEPS: usize = 25;

// Set by the library.
pub const FORCE: usize = 32; // 3
pub const TORQUE: usize = 35; // 3
pub const WRITES: usize = 38;
pub const READS: usize = 39;
pub const ENABLED: usize = 40;
pub const CLOSED: usize = 41;
pub const LAST_ID: usize = 42;
pub const WATCHDOG: usize = 43;
pub const WINDOW: usize = 44;
pub const LARGEST: usize = 45;
pub const NONZERO_AFTER_CLOSE: usize = 46;
pub const RUNNING: usize = 47;
pub const TURNS: usize = 48;
pub const UNSCHEDULED: usize = 49;
pub const OUT_OF_FRAME: usize = 50;
pub const SIMULATOR: usize = 51;
pub const EXPERT: usize = 52;
pub const GRIPPER: usize = 53;
pub const NAME_TRIES: usize = 54;
pub const SECOND_FORCE: usize = 55; // 3
/// How often the force was switched on although a person or the device had switched it off.
pub const OVERRIDDEN: usize = 58;
pub const MAX_FORCE: usize = 59;
pub const MAX_TORQUE: usize = 60;
pub const CALIBRATED: usize = 61;
/// Capabilities of HDAPI that were enabled, one bit each in the order of the stand-in.
pub const CAPABILITIES: usize = 62;
