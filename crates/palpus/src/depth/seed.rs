//! Starting directions of the walk.
