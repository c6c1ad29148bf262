//! Stick-slip friction tracked in time.
