"""Results in a file: the last of each method on each problem, so that a benchmark can be run piece by
piece."""

import json
from dataclasses import asdict, dataclass

from bench.measure import Result, Stop


@dataclass
class Measured:
    name: str
    kind: str
    size: int  # poses of a grid, cameras of a bundle adjustment
    start: float | None  # cost at the start
    best_known: float | None  # from earlier, and from nothing measured here
    results: list[Result]


def add(measured, new):
    """Keeps the results of all remaining methods from the same initial value."""
    old = measured.get(new.name)
    if old and old.start == new.start:
        names = [r.method for r in new.results]
        new.results += [r for r in old.results if r.method not in names]
    measured[new.name] = new


def load(path):
    """Returns the problems by name."""
    if not path.exists():
        return {}
    problems = json.loads(path.read_text())["problems"]
    results = [[Result(**r) for r in p.pop("results")] for p in problems]
    return {p["name"]: Measured(**p, results=rs) for p, rs in zip(problems, results)}


def save(path, measured, machine):
    document = {"machine": machine, "stop": asdict(Stop()), "problems": [asdict(m) for m in measured.values()]}
    path.write_text(json.dumps(document, indent=1) + "\n")
