"""The protocol of all adapters.

    adapter METHOD INPUT OUTPUT MAX_ITERATIONS RELATIVE_COST

INPUT has an initial value for every variable and fixes none of them: the adapter fixes the first pose. The
adapter solves, writes its estimate to OUTPUT in the format of INPUT's vertex lines, and prints one JSON
object.
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
    """Wall-clock seconds by stage, and their total."""

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
    """Peak memory so far in KiB: the memory that an interpreter and its libraries need before any data."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def report(**fields):
    print(json.dumps(fields))
