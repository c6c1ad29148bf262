//! The descent through two hierarchies to all leaf pairs within tolerance.
