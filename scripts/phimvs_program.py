"""The program that a script runs: --phimvs, the one on PATH, or the one that was built here.

For scripts of the source tree. compare_with_colmap is installed as a command by itself, and has its own.
"""
import shutil
import sys
from pathlib import Path

BUILT = Path(__file__).resolve().parent.parent / "build/release/phimvs"


def add_option(parser):
    parser.add_argument("--phimvs", default=shutil.which("phimvs") or str(BUILT),
                        help="the phimvs program; default: the one on PATH, else build/release/phimvs")


def require(program):
    """Ends the script where there is no such program, before it has made anything."""
    if not shutil.which(program):
        sys.exit(f"there is no program {program}: give --phimvs PROGRAM, put phimvs on PATH, or build it there "
                 "(cmake --preset release && cmake --build --preset release)")
