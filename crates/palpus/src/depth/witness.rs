//! Witness points of a CSO facet.
