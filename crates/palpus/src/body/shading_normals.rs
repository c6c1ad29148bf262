//! Per-corner normals for force shading, split at creases.
