//! Hands and clocks: devices, the simulated hand, the servo loop.
