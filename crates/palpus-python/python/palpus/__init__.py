"""palpus: contacts, penetration depth and haptic rendering of triangle meshes.

A `Body` is created from a mesh once. `contacts`, `distance` and `depth` then return results for an array of poses of one
body in the frame of another, on all cores. A `World` computes step by step the wrench of each tool, and a `Loop` runs a
world on a device.

Lengths are in the unit of the mesh file, unless a body is loaded with a unit; then everything is SI. A pose is a row
(tx, ty, tz, qx, qy, qz, qw) that places body a in body b's frame. A contact's normal has the length 1 and points from b
into a, and point_a - point_b = separation * normal.
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
    contact_tolerance,
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
    "contact_tolerance",
    "contacts",
    "depth",
    "distance",
    "query",
]
