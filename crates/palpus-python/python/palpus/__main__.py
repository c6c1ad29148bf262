"""The program: `palpus`, or `python -m palpus`."""

import signal
import sys

from ._native import main as _main


def main() -> int:
    """Runs the program with the arguments of the command line, and returns its exit status."""
    # The program handles Ctrl-C itself. Until it does, Ctrl-C ends the process.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _main(["palpus", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
