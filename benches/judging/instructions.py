"""Instructions of the engine's step, counted by callgrind while the programs replay BASE's recordings.

The count includes the functions that the step calls. The step is found by its name: a call of a function that matches STEP from a function
that does not match it.
"""
import re
import shutil

from judging import replay
from judging.bench import CannotRun
from judging.page import Resolution, Row, Table

STEP = re.compile(r"palpus::(?:render|world)::.*(?:Renderer|Duo|World)(?:<.*>)?>?::step(?:'\d+)?$")
# Two counts of one build are equal, so a small fraction is enough.
COUNTED = Resolution(0.0, 0.02)
ARMADILLO = "armadillo-intestine"
ARMADILLO_TICKS = 400


def instructions(bench):
    if not shutil.which("valgrind"):
        raise CannotRun("valgrind is not installed; it counts the instructions")

    def measure(side):
        figures = {}
        for scene in replay.scenes(bench):
            recording = replay.recordings(bench, scene)[0]
            figures[scene] = count(bench, side, scene, "replay", recording, "--json")
        if not bench.quick and bench.models.is_dir():
            out = bench.folder(side, "armadillo")
            words = ["bench", "scale", "--only", ARMADILLO, "--ticks", ARMADILLO_TICKS, "--passes", 1, "--models", bench.models, "--out", out]
            figures[f"{ARMADILLO} (bench scale)"] = count(bench, side, ARMADILLO, *words)
        return figures

    before, after = bench.each("instructions", measure)
    rows = [Row(name, value, after.get(name), "less", COUNTED) for name, value in before.items()]
    return [Table("Instructions of a step, mean", rows, "On the recorded device states of BASE.")]


def count(bench, side, name, *words):
    """Returns the mean instructions of a step; None if the build has no function with the step's name."""
    out = bench.folder(side) / f"callgrind.{name}"
    tool = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", "--compress-strings=no", "--compress-pos=no"]
    run = bench.start([*tool, bench.programs[side], *words], cwd=bench.folder(side))
    # A replay that differs ends with an error code, but it is counted too.
    if not out.exists() or out.stat().st_size == 0 or "signal" in run.stderr:
        raise CannotRun(f"{side}: callgrind on {name}: exit {run.returncode}: {run.stderr.strip()[-300:]}")
    calls, cost = steps(out)
    return cost / calls if calls else None


def steps(path):
    """Returns the number of calls of the step from outside, and the sum of their instructions."""
    caller = callee = ""
    calls = cost = 0
    with open(path, errors="replace") as file:
        for line in file:
            if line.startswith("fn="):
                caller = line[3:].strip()
            elif line.startswith("cfn="):
                callee = line[4:].strip()
            elif line.startswith("calls="):
                inclusive = next(file)
                if STEP.search(callee) and not STEP.search(caller):
                    calls += int(line[6:].split()[0])
                    cost += int(inclusive.split()[1])
    return calls, cost
