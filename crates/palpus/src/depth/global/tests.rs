//! Identities and known depths.
