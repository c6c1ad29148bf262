//! From a corner of the overlay to a facet of the CSO.
