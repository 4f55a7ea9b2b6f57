"""The command line: `manifactor`, or `python -m manifactor`."""

from __future__ import annotations

import sys

from . import _native


def main() -> int:
    """Runs the command line, and returns the exit code."""
    return _native.main(["manifactor", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
