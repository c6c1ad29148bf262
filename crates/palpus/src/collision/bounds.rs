//! Cheap conservative bounds in front of hull tests.
