//! What the makers' libraries see.
