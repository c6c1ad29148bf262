"""BASE records every built-in scene; NEW computes the wrenches again from the recorded states of the devices."""
import csv
import json
import math

from judging.page import EXACT, Row, Table

WRENCH = ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z")
TOOL = ("tool_tx", "tool_ty", "tool_tz")
SECONDS, QUICK_SECONDS = 10, 3
DIFFERING = "ticks that differ"


def scenes(bench):
    """The built-in scenes of BASE."""
    return [line.split()[0] for line in bench.palpus("base", "run", "--list").splitlines() if line.strip()]


def recordings(bench, scene):
    """Returns BASE's recording of a scene and, if there is one, of its second tool. They are recorded once in a run."""
    first = bench.folder("recordings") / f"{scene}.csv"
    second = first.with_name(f"{scene}-second.csv")
    done = first.with_suffix(".done")
    made_by = f"{bench.fingerprint('base')} {seconds(bench)}"
    if not (done.exists() and done.read_text() == made_by):
        bench.palpus("base", *run(bench, scene), "--record", first)
        done.write_text(made_by)
    return [path for path in (first, second) if path.exists()]


def seconds(bench):
    return QUICK_SECONDS if bench.quick else SECONDS


def run(bench, scene):
    return ["run", scene, "--headless", "--fast", "--lenient", "--duration", seconds(bench), "--json", "--force", "--fault-log", "none"]


def replay(bench):
    rows, offs = [], []
    for scene in scenes(bench):
        kept = recordings(bench, scene)
        devices = ["--device", f"replay:{kept[0]}"]
        if len(kept) > 1:
            devices += ["--second-device", f"replay:{kept[1]}"]
        again = bench.folder("new", "replayed") / f"{scene}.csv"
        bench.palpus("new", *run(bench, scene), *devices, "--record", again)
        for before in kept:
            after = again.with_name(before.name)
            offs.append((before.stem, difference(read(before), read(after))))
        rows.append(Row(f"{scene}: ticks that `palpus replay` finds identical", *identical(bench, kept[0]), "same", EXACT))
    for name, off in offs:
        rows += [Row(f"{name}: {what}", 0, value, "less", EXACT) for what, value in off.items() if value or what == DIFFERING]
    note = "Every difference is marked. If the algorithm was changed on purpose, a person has to decide whether it is right."
    return [Table("Replay of recordings", rows, note)]


def identical(bench, recording):
    """Returns the number of ticks, and the number of ticks in which the new program gives the same bits, for all tools together."""
    answer = bench.start([bench.programs["new"], "replay", recording, "--json"], cwd=bench.folder("new"))
    try:
        tools = json.loads(answer.stdout)
    except ValueError:
        return "a replay", f"exit {answer.returncode}: {answer.stderr.strip()[-200:]}"
    tools = [tools] + [tool for tool in tools.values() if isinstance(tool, dict) and "identical" in tool]
    return sum(tool["ticks"] for tool in tools), sum(tool["identical"] for tool in tools)


def read(path):
    with open(path) as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def difference(before, after):
    """Returns the differences between two recordings of the same device states."""
    differing = [i for i, (a, b) in enumerate(zip(before, after)) if any(a[c] != b[c] for c in (*WRENCH, *TOOL) if c in a)]
    return {
        "ticks missing": abs(len(before) - len(after)),
        DIFFERING: len(differing),
        "first tick that differs": differing[0] if differing else 0,
        "largest difference of the force (N)": largest(before, after, WRENCH[:3]),
        "largest difference of the torque (N·m)": largest(before, after, WRENCH[3:]),
        "largest difference of the tool's place (m)": largest(before, after, TOOL),
    }


def largest(before, after, columns):
    def apart(a, b):
        return math.dist([float(a[c] or "nan") for c in columns], [float(b[c] or "nan") for c in columns])

    if not before or columns[0] not in before[0]:
        return 0.0
    return max((d for d in (apart(a, b) for a, b in zip(before, after)) if not math.isnan(d)), default=0.0)
