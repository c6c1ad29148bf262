//! Which triangle lies across each edge.
