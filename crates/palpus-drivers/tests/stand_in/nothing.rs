// A library without any of the expected functions.

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetDeviceCount() -> i32 {
    1
}
