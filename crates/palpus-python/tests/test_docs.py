"""Runs the code of the tutorial, and compares its output with the page."""

import contextlib
import functools
import io
import pathlib
import re
from typing import Any

import pytest

import palpus

REPOSITORY = pathlib.Path(__file__).parents[3]
PAGE = REPOSITORY / "docs" / "python.md"


def test_tutorial(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(REPOSITORY / "examples")
    blocks = re.findall(r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?", PAGE.read_text(), re.DOTALL)
    assert len(blocks) >= 4
    # The loop of the page runs in real time. This machine may be too busy to keep the rate.
    monkeypatch.setattr(palpus, "Loop", functools.partial(palpus.Loop, real_time=False))
    names: dict[str, Any] = {}
    for code, expected in blocks:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, str(PAGE), "exec"), names)
        assert printed.getvalue() == expected
    picture = (tmp_path / "contacts.png").read_bytes()
    assert picture.startswith(b"\x89PNG") and len(picture) > 10_000
