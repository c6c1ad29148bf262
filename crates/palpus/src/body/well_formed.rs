//! The walkers that assert every invariant of the body's structures.
