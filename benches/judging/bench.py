"""The two compared programs: starts them and stores their figures."""
import hashlib
import importlib.util
import json
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SIDES = ("base", "new")


class CannotRun(Exception):
    """A requirement of a judge is missing; the text names it."""


class Bench:
    def __init__(self, given):
        self.programs = {"base": given.base.resolve(), "new": given.new.resolve()}
        self.out = given.out.resolve()
        self.only, self.quick = given.only, given.quick
        self.models, self.reference, self.kept = given.models, given.reference, given.kept
        for side in SIDES:
            self.folder(side)
        self.figures = {}
        self.earlier = self.read_earlier(given.before) if given.before else {}

    def folder(self, *names):
        """Returns a folder in the page's folder, which is created if it is missing."""
        folder = self.out.joinpath(*names)
        folder.mkdir(parents=True, exist_ok=True)
        return folder

    def fingerprint(self, side):
        return hashlib.sha256(self.programs[side].read_bytes()).hexdigest()[:16]

    def read_earlier(self, folder):
        kept = self.kept_in(folder)
        if kept is None:
            raise SystemExit(f"{folder} has no figures of this BASE, or quick figures instead of full ones (or the reverse); leave out --before")
        return kept

    def kept_in(self, folder):
        """Returns the figures of this BASE that an earlier run stored in a folder; `None` if no run has stored them."""
        path = folder / "figures.json"
        kept = json.loads(path.read_text()) if path.exists() else {}
        return kept["figures"] if kept.get("base") == self.fingerprint("base") and kept["quick"] == self.quick else None

    def environment(self):
        """Returns an environment in which the user's caches and fault logs are neither read nor written."""
        own = {"XDG_CACHE_HOME": self.folder("cache"), "XDG_STATE_HOME": self.folder("state")}
        return os.environ | {name: str(path) for name, path in own.items()}

    def start(self, command, **named):
        """Runs a command; returns its output and its exit code."""
        command = [str(word) for word in command]
        return subprocess.run(command, capture_output=True, text=True, env=self.environment(), **named)

    def palpus(self, side, *words):
        """Runs one of the programs; returns its output. Raises `CannotRun` with the end of its error text if it fails."""
        run = self.start([self.programs[side], *words], cwd=self.folder(side))
        if run.returncode:
            raise CannotRun(f"{side}: palpus {' '.join(map(str, words))}: exit {run.returncode}: {run.stderr.strip()[-300:]}")
        return run.stdout

    def each(self, name, measure):
        """Returns `measure(side)` for both programs. BASE's figures come from an earlier run if there is one."""
        answers = {side: self.earlier[name] if side == "base" and name in self.earlier else measure(side) for side in SIDES}
        self.figures[name] = answers["base"]
        return answers["base"], answers["new"]

    def keep(self):
        """Stores BASE's figures for `--before`, including those of judges that ran earlier."""
        figures = (self.kept_in(self.out) or {}) | self.earlier | self.figures
        kept = {"base": self.fingerprint("base"), "quick": self.quick, "figures": figures}
        (self.out / "figures.json").write_text(json.dumps(kept, indent=1, ensure_ascii=False))

    def python(self):
        """Returns a Python with numpy: this one, or the environment that `.ci/run` uses too."""
        if importlib.util.find_spec("numpy"):
            return sys.executable
        own = ROOT / "target" / "ci-python"
        python = own / "bin" / "python"
        if not python.exists():
            subprocess.run([sys.executable, "-m", "venv", own], check=True)
        if subprocess.run([python, "-c", "import numpy"], capture_output=True).returncode:
            subprocess.run([python, "-m", "pip", "install", "--quiet", "numpy"], check=True)
        return python
