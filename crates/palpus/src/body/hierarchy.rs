//! The binary tree of hulls over the pieces.
