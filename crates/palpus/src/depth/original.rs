//! Repair of depth answers that rest on virtual features.
