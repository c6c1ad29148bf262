"""The command-line program in the package."""

import pathlib
import subprocess
import sys
import sysconfig

import pytest

import palpus
from models import MESHES

SCRIPT = pathlib.Path(sysconfig.get_path("scripts")) / "palpus"


@pytest.mark.parametrize("command", [[sys.executable, "-m", "palpus"], [str(SCRIPT)]])
def test_program_runs(command: list[str], tmp_path: pathlib.Path) -> None:
    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*command, *arguments], cwd=tmp_path, capture_output=True, text=True)

    result = run("--version")
    assert (result.returncode, result.stdout) == (0, f"palpus {palpus.__version__}\n")
    wrong = run("query", "--no-such")
    assert wrong.returncode == 2 and "--no-such" in wrong.stderr
    missing = run("prepare", "none.obj")
    assert missing.returncode == 1 and "none.obj: cannot be read" in missing.stderr
    (tmp_path / "poses.csv").write_text("tx,ty,tz,qx,qy,qz,qw\n15,15,10,0,0,0,1\n")
    meshes = [str(MESHES / "peg.obj"), str(MESHES / "bracket.obj")]
    done = run("--no-cache", "query", *meshes, "--poses", "poses.csv", "--out", "out.csv")
    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "out.csv").read_text().splitlines()) == 2


def test_error_texts_equal_those_of_the_program(tmp_path: pathlib.Path) -> None:
    broken = tmp_path / "broken.obj"
    broken.write_text("v 0 0 0\nv 1 0 0\nv 0 1 x\nf 1 2 3\n")
    with pytest.raises(palpus.Error) as raised:
        palpus.Body.load(broken)
    result = subprocess.run([sys.executable, "-m", "palpus", "prepare", str(broken)], capture_output=True, text=True)
    assert str(raised.value) in result.stderr
