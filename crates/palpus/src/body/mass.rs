//! Volume, centre of mass and inertia.
