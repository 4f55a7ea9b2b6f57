"""Compares the examples with GTSAM's: `python benchmarks/examples.py [IMU.txt GPS.txt DR.txt TD.txt]`, with the files of
KITTI and Plaza in gtsam's package. Prints lines of code, and CPU times without imports."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[3]
RUNS = 5


def lines(path: Path) -> int:
    """Returns the number of lines without empty ones, comments and docstrings."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    documented = [node for node in ast.walk(tree) if isinstance(node, (ast.Module, ast.FunctionDef)) and ast.get_docstring(node)]
    dropped = {n for node in documented for n in range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1)}
    code = [line.strip() for n, line in enumerate(text.splitlines(), start=1) if n not in dropped]
    return sum(bool(line) and not line.startswith("#") for line in code)


#: Runs a script and prints its CPU time, after the import of its library.
RUN = """
import contextlib, io, runpy, sys, time
import numpy, {library}
sys.argv = sys.argv[1:]
begun = time.process_time()
with contextlib.redirect_stdout(io.StringIO()):
    runpy.run_path(sys.argv[0])
print(time.process_time() - begun)
"""


def seconds(library: str, command: list[str], folder: str) -> float:
    """Returns the CPU time of a script, the least of several runs."""
    run = [sys.executable, "-c", RUN.format(library=library), *command]
    # gtsam's messages are printed before
    times = [subprocess.run(run, cwd=folder, capture_output=True, check=True, text=True).stdout for _ in range(RUNS)]
    return min(float(printed.split()[-1]) for printed in times)


def main() -> None:
    os.environ["RAYON_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = os.environ["TBB_NUM_THREADS"] = "1"
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "out").mkdir()
        print("| example | lines | gtsam | ratio | CPU time, ms | gtsam | ratio |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
        for ours in sorted((ROOT / "examples" / "python").glob("*.py")):
            theirs = ROOT / "tests" / "peers" / "python" / ours.name
            if not theirs.exists():
                continue
            given = {"imu_gps": sys.argv[1:3], "range_slam": sys.argv[3:5]}.get(ours.stem, [])
            (a, b), scripts = (lines(ours), lines(theirs)), {"manifactor": ours, "gtsam": theirs}
            s, t = (1e3 * seconds(library, [str(path), *given], folder) for library, path in scripts.items())
            print(f"| `{ours.stem}` | {a} | {b} | {a / b:.2f} | {s:.1f} | {t:.1f} | {s / t:.2f} |", flush=True)


if __name__ == "__main__":
    main()
