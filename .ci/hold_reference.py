#!/usr/bin/env python3
"""Runs the reference scripts and compares their results with fixed limits.

usage: hold_reference.py REFERENCE_FOLDER MODELS_FOLDER PALPUS

Convex pairs: no wrong answers. Answers that are only local minima ("local only") are allowed in 3 %
of the overlapping `random` frames of all folders together, and in none of the `sliding` frames.
Non-convex pairs: no wrong answers. Depths of solids: no wrong answers, and bounds within 1 % of the
smaller body in 99 % of the overlapping frames. Closed loops with a simulated hand: no wrong
answers; the scenes in JOINED have other limits.
"""
import pathlib
import re
import subprocess
import sys

LOCAL_ONLY_SHARE = 0.03

LINE = re.compile(
    r"^(?P<folder>[^/\s]+)/(?P<poses>\w+): \d+ checked \((?P<deep>\d+) overlapping, \d+ disjoint\), "
    r"(?P<wrong>\d+) wrong of which (?P<local>\d+) local only"
)


def convex(reference, palpus):
    folders = sorted(p for p in (reference / "convex").iterdir() if p.is_dir())
    script = [sys.executable, reference / "check_query.py", *folders, "--palpus", palpus]
    answer = subprocess.run(script, capture_output=True, text=True)
    print(answer.stdout, end="")
    print(answer.stderr, end="", file=sys.stderr)
    rows = [m for m in map(LINE.match, answer.stdout.splitlines()) if m]
    if len(rows) != 2 * len(folders):
        return [f"{len(rows)} result lines for {len(folders)} folders"]
    faults = [f"{m['folder']}/{m['poses']}: wrong answers" for m in rows if m["wrong"] != m["local"]]
    faults += [f"{m['folder']}/sliding: local only" for m in rows if m["poses"] == "sliding" and m["local"] != "0"]
    deep = sum(int(m["deep"]) for m in rows if m["poses"] == "random")
    local = sum(int(m["local"]) for m in rows if m["poses"] == "random")
    print(f"random: {local} of {deep} overlapping frames are local only ({100 * local / deep:.2f} %)")
    if local > LOCAL_ONLY_SHARE * deep:
        faults.append("random: too many are local only")
    return faults


def nonconvex(reference, models, palpus):
    script = [sys.executable, reference / "check_nonconvex.py", reference / "nonconvex", models, "--palpus", palpus]
    return [] if subprocess.run(script).returncode == 0 else ["non-convex: wrong answers"]


# Scenes whose limit no engine can meet, and the limit that is used instead (N). The run of dir_sphere_s_f begins in free air and ends
# with a press of 1.6 N. The script's Fourier transform treats the run as periodic, so even a smooth rise to this force counts as 0.112 N
# of hum; the limit is 0.08 N. Within the run the hum is 0.03 N (0.07 N where the motion begins).
JOINED = {"dir_sphere_s_f": 0.120}

FEEL = re.compile(r"^(?P<scene>\S+)\s+(?P<verdict>ok|WRONG (?P<what>.*?))\s+hum (?P<hum>[\d.]+) mN")


def feel(reference, palpus):
    scenes = reference / "feel"
    if not scenes.is_dir():
        print("skipped: no closed loops of feel beside the reference answers")
        return []
    folders = sorted(p for p in scenes.iterdir() if p.is_dir())
    script = [sys.executable, reference / "check_feel.py", *folders, "--palpus", palpus]
    answer = subprocess.run(script, capture_output=True, text=True)
    print(answer.stdout, end="")
    print(answer.stderr, end="", file=sys.stderr)
    rows = [m for m in map(FEEL.match, answer.stdout.splitlines()) if m]
    if len(rows) != len(folders):
        return [f"feel: {len(rows)} result lines for {len(folders)} scenes"]

    def holds(row):
        joined = row["what"] == "hum_force" and 1e-3 * float(row["hum"]) <= JOINED.get(row["scene"], 0.0)
        return row["verdict"] == "ok" or joined

    return [f"feel: {row['scene']}" for row in rows if not holds(row)]


CLOSED_SHARE = 0.99

TOTAL = re.compile(r"^total \d+ checked, \d+ wrong; overlapping (?P<deep>\d+): bracket <= 1 % of size on (?P<closed>\d+),", re.M)


def solids(reference, palpus):
    if not (reference / "global").is_dir():
        print("skipped: no depths of solids beside the reference answers")
        return []
    script = [sys.executable, reference / "check_global.py", reference / "global", "--palpus", palpus]
    answer = subprocess.run(script, capture_output=True, text=True)
    print(answer.stdout, end="")
    print(answer.stderr, end="", file=sys.stderr)
    faults = ["global: wrong answers"] if answer.returncode else []
    total = TOTAL.search(answer.stdout)
    if not total or int(total["closed"]) < CLOSED_SHARE * int(total["deep"]):
        faults.append("global: too many brackets are wider than 1 %")
    return faults


def main():
    reference, models, palpus = map(pathlib.Path, sys.argv[1:4])
    faults = convex(reference, palpus) + nonconvex(reference, models, palpus) + solids(reference, palpus)
    faults += feel(reference, palpus)
    for fault in faults:
        print("FAILED:", fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
