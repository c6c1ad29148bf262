"""palpus: contacts, penetration depth and haptic rendering of triangle meshes.

A `Body` is made of a mesh once. `contacts`, `distance` and `depth` then answer for as many poses of one body in the
frame of another as an array has rows, on all cores; a `World` says what tools feel, step by step, and a `Loop` runs it on a device.

Lengths are those of the mesh file unless a body is loaded with a unit; then all is SI. A pose is a row
(tx, ty, tz, qx, qy, qz, qw) that places body a in body b's frame. A contact's normal is unit and points from b into a,
and point_a - point_b = separation * normal.
"""

from ._native import (
    CONTACT,
    DEPTH,
    DISTANCE,
    Body,
    Error,
    Loop,
    Settings,
    World,
    __version__,
    contacts,
    depth,
    distance,
    query,
)

__all__ = [
    "CONTACT",
    "DEPTH",
    "DISTANCE",
    "Body",
    "Error",
    "Loop",
    "Settings",
    "World",
    "__version__",
    "contacts",
    "depth",
    "distance",
    "query",
]
