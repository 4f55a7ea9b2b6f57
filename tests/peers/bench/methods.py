"""The compared programs: each method of each peer, and ours."""

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

from bench import pose_graph

POSE_GRAPHS = ("se2", "se3")
ALL = ("se2", "se3", "grid", "quadrics", "bundle")


@dataclass(frozen=True)
class Method:
    """A solver with settings: `adapter METHOD INPUT OUTPUT MAX_ITERATIONS RELATIVE_COST`."""

    peer: str
    method: str
    adapter: tuple[str, ...]
    kinds: tuple[str, ...]
    ours: bool = False

    @property
    def name(self):
        return f"{self.peer} {self.method}"

    @property
    def folder(self):
        return self.name.replace(" ", "_")

    def command(self, source, output, stop):
        return [*self.adapter, self.method, source, output, stop.max_iterations, stop.relative_cost]


class Ours:
    """The release binary of this repository."""

    def __init__(self, binary):
        self.binary = str(binary)

    def solvers(self):
        listed = subprocess.run([self.binary, "list", "solvers", "--json"], capture_output=True, check=True)
        return [entry["name"] for entry in json.loads(listed.stdout)]

    def default_solvers(self):
        """Returns the solver that needs no choice, if there is one."""
        return ["auto"] if "auto" in self.solvers() else ["levenberg_marquardt", "gauss_newton"]

    def start(self, source, output):
        """Returns initial values for a file without vertices: spanning trees of odometry."""
        solve = [self.binary, "solve", source, "--out", output, "--force", "--json"]
        nothing = ["--solver", "gauss_newton", "--set", "solver.stop.max_iterations=0"]
        subprocess.run([*solve, *nothing], capture_output=True, check=False)
        return pose_graph.read(Path(output)).vertices

    def begin(self, document, output, data):
        """Writes the initial graphs of a run; returns the messages, in case the graphs are missing."""
        nothing = ["--set", "solver.type=levenberg_marquardt", "--set", "solver.stop.max_iterations=0"]
        command = [self.binary, "run", document, "--out", output, "--force", "--data", data, *nothing]
        return subprocess.run(command, capture_output=True, text=True, check=False).stderr.strip()
