//! Keeping a wrench within the device's limits.
