//! Penalty force and torque.
