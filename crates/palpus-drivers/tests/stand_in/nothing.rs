// A library that is none of ours.

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetDeviceCount() -> i32 {
    1
}
