//! One contact for each cluster.
