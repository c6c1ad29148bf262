"""The reference scripts: certified and exact answers, and closed loops of feel."""
import re

from judging.bench import CannotRun
from judging.page import EXACT, Resolution, Row, Table

CONVEX = re.compile(
    r"^(?P<name>\S+/\w+): (?P<checked>\d+) checked .*?, (?P<wrong>\d+) wrong of which (?P<local>\d+) local only, "
    r"worst excess (?P<excess>[\d.]+) %"
)
PLAIN = re.compile(r"^(?P<name>\S+): (?P<checked>\d+) checked.*?, (?P<wrong>\d+) wrong")
NARROW = re.compile(r"bracket <= 1 % of size on (?P<narrow>\d+)")
FEEL = re.compile(
    r"^(?P<name>\S+)\s+(?:ok|WRONG .*?)\s+hum (?P<force>[\d.]+) mN (?P<torque>[\d.]+) mN·m, "
    r"energy (?P<energy>-?[\d.]+) mJ, depth (?P<depth>[\d.]+) mm,.*faults (?P<faults>\d+)"
)
# Larger figures are better if their names contain one of these words. All other figures should be
# small.
GROW = ("checked", "brackets")


def lines(bench, side, script, *words):
    """Returns the output of a reference script for a program. Exit status 1 only means that an answer is wrong."""
    path = bench.reference / script
    if not path.is_file():
        raise CannotRun(f"{path} does not exist; name the reference answers with --reference FOLDER")
    run = bench.start([bench.python(), path, *words, "--palpus", bench.programs[side]], cwd=bench.folder(side))
    if run.returncode not in (0, 1) or not run.stdout:
        raise CannotRun(f"{script} with {side}: exit {run.returncode}: {run.stderr.strip()[-300:]}")
    (bench.folder(side) / f"{path.stem}.txt").write_text(run.stdout)
    return run.stdout.splitlines()


def folders(folder):
    return sorted(path for path in folder.iterdir() if path.is_dir())


def answers(bench):
    def measure(side):
        figures = {}
        for text in lines(bench, side, "check_query.py", *folders(bench.reference / "convex")):
            if row := CONVEX.match(text):
                name = row["name"]
                figures |= {f"{name}: checked": int(row["checked"]), f"{name}: wrong": int(row["wrong"])}
                figures |= {f"{name}: local only": int(row["local"]), f"{name}: worst excess (%)": float(row["excess"])}
        for text in lines(bench, side, "check_nonconvex.py", bench.reference / "nonconvex", bench.models):
            if row := PLAIN.match(text):
                figures |= {f"{row['name']}: checked": int(row["checked"]), f"{row['name']}: wrong": int(row["wrong"])}
        return figures | global_depth(bench, side)

    before, after = bench.each("reference", measure)
    return [Table("Reference answers", compared(before, after, lambda name: EXACT), brief=True)]


def global_depth(bench, side):
    """Returns the figures of the proven depth of non-convex bodies, if the program has this command."""
    if bench.start([bench.programs[side], "depth", "--help"]).returncode:
        return {}
    figures = {}
    for text in lines(bench, side, "check_global.py", *folders(bench.reference / "global")):
        if row := PLAIN.match(text):
            figures |= {f"{row['name']}: checked": int(row["checked"]), f"{row['name']}: wrong": int(row["wrong"])}
            if narrow := NARROW.search(text):
                figures[f"{row['name']}: brackets within 1 %"] = int(narrow["narrow"])
    return figures


def closed_loops(bench):
    def measure(side):
        figures = {}
        for text in lines(bench, side, "check_feel.py", *folders(bench.reference / "feel")):
            if row := FEEL.match(text):
                figures |= {f"{row['name']}: hum (mN)": float(row["force"]), f"{row['name']}: hum (mN·m)": float(row["torque"])}
                figures |= {f"{row['name']}: energy (mJ)": float(row["energy"]), f"{row['name']}: depth (mm)": float(row["depth"])}
                figures[f"{row['name']}: faults"] = int(row["faults"])
        return figures

    before, after = bench.each("closed-loops", measure)
    note = "Energy: the limit is 0.05 mJ; hum: 60 mN and 1.5 mN·m unless the scene has limits of its own."
    return [Table("Closed loops of the reference", compared(before, after, loop_resolution), note)]


def loop_resolution(name):
    """Returns a tenth of the script's default limits plus 2 % of the figure: after one rounding difference, a loop takes another path."""
    floors = {"hum (mN)": 6.0, "hum (mN·m)": 0.15, "energy (mJ)": 0.005, "depth (mm)": 0.005}
    floor = floors.get(name.split(": ")[1])
    return Resolution(floor, 0.02) if floor else EXACT


def compared(before, after, resolution):
    """Returns a row for each figure of BASE. Figures that only NEW has are left out, because there is nothing to compare them with."""
    return [
        Row(name, value, after.get(name), "more" if any(word in name for word in GROW) else "less", resolution(name))
        for name, value in before.items()
    ]
