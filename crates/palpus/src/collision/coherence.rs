//! What a pair remembers of the last tick.
