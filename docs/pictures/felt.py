#!/usr/bin/env python3
"""Makes the moving picture of the README: a run of spoon-cup, one picture for every 0.11 s.

usage: felt.py PALPUS      (needs Pillow from PyPI; writes felt.gif beside this file)
"""
import pathlib
import subprocess
import sys
import tempfile

from PIL import Image

FRAMES, BEGIN_S, STEP_S = 45, 1.0, 0.11
# Numbers of colours: those that cover most pixels, and those that differ most (arrows and dots are
# small).
COMMON_COLORS, RARE_COLORS = 112, 48
PALETTE_FRAMES = 5


def palette_of(frames):
    """Returns an image with the palette for all frames."""
    width, height = frames[0].size
    some = Image.new("RGB", (width, height * PALETTE_FRAMES))
    for k in range(PALETTE_FRAMES):
        some.paste(frames[k * (len(frames) - 1) // (PALETTE_FRAMES - 1)], (0, k * height))
    colors = []
    for method, count in [(Image.Quantize.MEDIANCUT, COMMON_COLORS), (Image.Quantize.MAXCOVERAGE, RARE_COLORS)]:
        colors += some.quantize(count, method=method).getpalette()[: 3 * count]
    palette = Image.new("P", (1, 1))
    # Pillow requires 256 colours.
    palette.putpalette(colors + colors[:3] * (256 - len(colors) // 3))
    return palette


def main():
    palpus = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        recording = pathlib.Path(folder, "run.csv")
        quiet = {"check": True, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        subprocess.run([palpus, "run", "spoon-cup", "--fast", "--headless", "--duration", "8", "--record", recording], **quiet)
        frames = []
        for k in range(FRAMES):
            picture = pathlib.Path(folder, f"{k}.png")
            subprocess.run([palpus, "replay", recording, "--screenshot", picture, "--at", str(BEGIN_S + k * STEP_S),
                            "--size", "640x400", "--zoom", "1.0"], **quiet)
            frames.append(Image.open(picture).convert("RGB"))
    # One palette for all frames, so that only the pixels that move are stored again.
    palette = palette_of(frames)
    first, *rest = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    first.save(pathlib.Path(__file__).with_name("felt.gif"), save_all=True, append_images=rest,
               duration=int(1e3 * STEP_S), loop=0, optimize=True)


if __name__ == "__main__":
    main()
