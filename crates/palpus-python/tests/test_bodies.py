"""Bodies from files, arrays and meshes of other packages."""

import pathlib

import numpy as np
import pytest

import palpus
from models import MESHES

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def test_arrays_give_the_same_body_as_the_file(peg: palpus.Body) -> None:
    again = palpus.Body.from_arrays(peg.vertices, peg.triangles)
    assert again.piece_count == peg.piece_count
    assert again.volume == pytest.approx(peg.volume, rel=1e-12)


def test_mass_of_a_tetrahedron() -> None:
    body = palpus.Body.from_arrays(CORNERS * 10, FACES, unit="mm")
    assert body.volume == pytest.approx(1e-6 / 6)
    np.testing.assert_allclose(body.center_of_mass, [0.0025] * 3)
    # The integral of x² about the centre is 1/60 − 1/96 for an edge of length 1.
    np.testing.assert_allclose(np.diag(body.inertia), 2 * (1 / 60 - 1 / 96) * 1e-10)
    assert body.size == pytest.approx(0.01 * 3**0.5)
    assert body.mass_source == "mesh"
    assert body.piece_count == 1
    vertices, triangles = body.piece(0)
    assert vertices.shape == (4, 3) and triangles.shape == (4, 3)
    assert body.health()["closed"] and body.health()["genus"] == 0


def test_open_mesh_is_reported() -> None:
    health = palpus.Body.from_arrays(CORNERS, FACES[:3]).health()
    assert not health["closed"] and health["boundary_edges"] == 3
    assert "open" in " ".join(health["notices"]) or "boundary" in " ".join(health["notices"])


def test_polygons_of_four_corners() -> None:
    corners = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    assert palpus.Body.from_arrays(corners, faces).volume == pytest.approx(1)


def test_trimesh_is_accepted() -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.icosphere(subdivisions=2)
    body = palpus.Body.from_mesh(mesh)
    assert body.volume == pytest.approx(mesh.volume)
    np.testing.assert_allclose(body.inertia, mesh.moment_inertia, atol=1e-12)


def test_cached_body_equals_new_body(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    made, kept = (palpus.Body.load(MESHES / "bracket.obj") for _ in range(2))
    assert len(list(tmp_path.rglob("*.body"))) == 1
    for k in range(made.piece_count):
        np.testing.assert_array_equal(made.piece(k)[0], kept.piece(k)[0])


def test_bad_input_gives_clear_errors() -> None:
    def refuses(text: str, *arguments: object, **named: object) -> None:
        with pytest.raises(palpus.Error, match=text):
            palpus.Body.from_arrays(*arguments, **named)  # type: ignore[arg-type]

    refuses("vertex 3.*not a finite", [*CORNERS[:3], [0, 0, np.nan]], FACES)
    refuses("names vertex 6", CORNERS, FACES + 6)
    refuses("vertex -1 in face 0", CORNERS, FACES - 1)
    refuses("type float64", CORNERS, FACES * 0.5)
    refuses(r"shape \[4\]", CORNERS, FACES[0].repeat(2)[:4])
    refuses(r"vertices has the shape \[4, 2\]", CORNERS[:, :2], FACES)
    refuses("no faces", CORNERS, np.zeros((0, 3), dtype=int))
    refuses("unit \"parsec\"", CORNERS, FACES, unit="parsec")
    refuses("give one of them", CORNERS, FACES, unit="mm", scale=2.0)
    refuses("scale must be", CORNERS, FACES, scale=0.0)
    refuses("flatness must be", CORNERS, FACES, flatness=1.0)
    refuses("workers is 0", CORNERS, FACES, workers=0)
    with pytest.raises(palpus.Error, match="no piece 1"):
        palpus.Body.from_arrays(CORNERS, FACES).piece(1)
    with pytest.raises(palpus.Error, match="none.obj: cannot be read"):
        palpus.Body.load("none.obj")
    with pytest.raises(palpus.Error, match="has no vertices"):
        palpus.Body.from_mesh(3)  # type: ignore[arg-type]
