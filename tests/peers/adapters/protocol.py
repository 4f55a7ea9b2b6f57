"""What every adapter is told and tells.

    adapter METHOD INPUT OUTPUT MAX_ITERATIONS RELATIVE_COST

INPUT has a start for every variable and holds none of them: the adapter holds the first pose. The adapter
solves, writes its estimate to OUTPUT in the form of INPUT's vertex lines, and prints one JSON object.
"""

import json
import resource
import sys
import time
from dataclasses import dataclass


@dataclass
class Task:
    method: str
    input: str
    output: str
    max_iterations: int
    relative_cost: float

    @classmethod
    def from_arguments(cls):
        method, source, output, iterations, relative = sys.argv[1:]
        return cls(method, source, output, int(iterations), float(relative))


class Stages:
    """Wall-clock seconds, by stage and in total."""

    def __init__(self):
        self.seconds = {}
        self.began = self.last = time.perf_counter()

    def end(self, stage):
        now = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self.last
        self.last = now

    def total(self):
        return self.last - self.began


def resident_kib():
    """The most memory held so far, KiB: what an interpreter and its libraries need before any data."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def report(**fields):
    print(json.dumps(fields))
