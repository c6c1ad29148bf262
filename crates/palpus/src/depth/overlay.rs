//! Where two normal cones overlap on the sphere.
