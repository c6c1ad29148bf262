"""Preparation of a library of parts: bodies for the user's cache folder, and a table of the state of the meshes.

    rows = [prepare(file, unit="mm") for file in parts("library")]
    write(rows, "health.parquet")

does this in a loop, and `palpus.ray.prepare` does it on many cores and machines. The table has a row for each part, sorted
by file name: `file`, `error` (empty if the part can be used), `pieces`, `triangles`, `volume`, `size`, `closed`,
`manifold`, `components`, `boundary_edges`, `non_manifold_edges`, `self_intersecting_triangles`, `notices` (one per line).
"""

import os
import pathlib
from collections.abc import Iterable
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from ._native import Body, Error

__all__ = ["SCHEMA", "parts", "prepare", "write"]

_MESHES = {".obj", ".stl", ".ply", ".off", ".gltf", ".glb"}

_COUNTS = ("components", "boundary_edges", "non_manifold_edges", "self_intersecting_triangles")

SCHEMA = pa.schema(
    [
        ("file", pa.string()),
        ("error", pa.string()),
        *((name, pa.uint64()) for name in ("pieces", "triangles")),
        *((name, pa.float64()) for name in ("volume", "size")),
        *((name, pa.bool_()) for name in ("closed", "manifold")),
        *((name, pa.uint64()) for name in _COUNTS),
        ("notices", pa.string()),
    ]
)


def parts(library: str | os.PathLike[str]) -> list[str]:
    """Returns the mesh files in a folder and its subfolders, or the one file, sorted by name."""
    path = pathlib.Path(library)
    files = [path] if path.is_file() else sorted(file for file in path.rglob("*") if file.suffix.lower() in _MESHES)
    if not files:
        raise Error(f"{path}: there are no meshes; give a mesh file, or a folder with mesh files")
    return [str(file) for file in files]


def prepare(file: str, *, unit: str | None = None, workers: int | None = 1) -> dict[str, Any]:
    """Prepares a part, stores it in the cache folder, and returns its table row. A bad part has an error in its row."""
    row: dict[str, Any] = dict.fromkeys(SCHEMA.names)
    row.update(file=file, error="", notices="")
    try:
        body = Body.load(file, unit=unit, workers=workers)
    except Error as error:
        return {**row, "error": str(error)}
    health = body.health()
    row.update(pieces=body.piece_count, triangles=len(body.triangles), volume=body.volume, size=body.size)
    row.update(closed=health["closed"], manifold=health["manifold"], notices="\n".join(health["notices"]))
    row.update(boundary_edges=health["boundary_edges"], components=health["components"])
    row.update(non_manifold_edges=health["non_manifold_edges"])
    row.update(self_intersecting_triangles=health["self_intersecting_triangles"])
    return row


def write(rows: Iterable[dict[str, Any]], out: str | os.PathLike[str]) -> None:
    """Writes the table, sorted by file name."""
    path = pathlib.Path(out)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    table = pa.Table.from_pylist(sorted(rows, key=lambda row: str(row["file"])), schema=SCHEMA)
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, unfinished, compression="zstd")
    unfinished.replace(path)
