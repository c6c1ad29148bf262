//! The walk over hub pairs.
