"""Where the meshes of the examples are."""

import pathlib

MESHES = pathlib.Path(__file__).parents[3] / "examples" / "meshes"
