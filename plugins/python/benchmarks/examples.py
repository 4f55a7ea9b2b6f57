"""Compares the examples with GTSAM's: `python benchmarks/examples.py`. Prints lines of code, and CPU times of whole processes."""

from __future__ import annotations

import ast
import os
import resource
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


def seconds(command: list[str], folder: str) -> float:
    """Returns the CPU time of a process, the least of several runs."""
    times = []
    for _ in range(RUNS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(times)


def main() -> None:
    os.environ["RAYON_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = os.environ["TBB_NUM_THREADS"] = "1"
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "out").mkdir()
        empty = {name: seconds([sys.executable, "-c", f"import numpy, {name}"], folder) for name in ("manifactor", "gtsam")}
        print(f"imports: {empty['manifactor']:.2f} s, gtsam {empty['gtsam']:.2f} s\n")
        print("| example | lines | gtsam | ratio | CPU time, s | gtsam | ratio |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
        for ours in sorted((ROOT / "examples" / "python").glob("*.py")):
            theirs = ROOT / "tests" / "peers" / "python" / ours.name
            if not theirs.exists():
                continue
            arguments = sys.argv[1:] if ours.stem == "imu_gps" else []
            (a, b), (s, t) = (lines(ours), lines(theirs)), (seconds([sys.executable, str(p), *arguments], folder) for p in (ours, theirs))
            print(f"| `{ours.stem}` | {a} | {b} | {a / b:.2f} | {s:.2f} | {t:.2f} | {s / t:.2f} |", flush=True)


if __name__ == "__main__":
    main()
