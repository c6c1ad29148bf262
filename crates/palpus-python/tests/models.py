"""The folder with the meshes of the examples."""

import pathlib

MESHES = pathlib.Path(__file__).parents[3] / "examples" / "meshes"
