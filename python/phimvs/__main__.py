"""The command line: python -m phimvs COMMAND [--option value]..."""

import sys

from . import _core


def main() -> int:
    return _core.main(["phimvs", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
