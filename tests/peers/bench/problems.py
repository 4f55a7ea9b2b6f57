"""The problems, and their inputs: every method gets the same file, with a start for every pose."""

from dataclasses import dataclass
from pathlib import Path

from bench import grids, pose_graph


@dataclass
class Problem:
    name: str
    kind: str  # se2, se3 or quadrics
    file: str = ""  # below the folder of data; empty where the benchmark makes it
    best_known: float | None = None  # of 1/2 sum r' Omega r, where it has been published or found before
    side: int = 0  # of a grid

    def input(self, folder):
        return folder / f"{self.name}.g2o"


PUBLISHED = [
    Problem("M3500", "se2", "g2o/input_M3500_g2o.g2o", 68.957439123),
    Problem("intel", "se2", "g2o/intel.g2o", 22.50212),
    Problem("INTEL", "se2", "g2o/input_INTEL_g2o.g2o", 107.919),
    Problem("CSAIL", "se2", "g2o/CSAIL.g2o", 20.275441672),
    Problem("MIT", "se2", "g2o/MIT.g2o", 262.66397),
    Problem("kitti_00", "se2", "g2o/kitti_00.g2o", 49.161069116),
    Problem("manhattan", "se2", "g2o/manhattan.g2o", 1774.520535),
    Problem("sphere2500", "se3", "g2o/sphere2500.g2o", 675.700962927),
    Problem("parking-garage", "se3", "g2o/parking-garage.g2o", 0.634192399632),
    Problem("torus3D", "se3", "g2o/torus3D.g2o", 12117.636879),
    Problem("smallGrid3D", "se3", "g2o/smallGrid3D.g2o", 517.92533236),
]


def grid(poses):
    """A cube of about so many poses."""
    side = round(poses ** (1.0 / 3.0))
    return Problem(f"grid_{side**3}", "se3", side=side)


def prepare(problem, data, folder, ours):
    """Writes the input unless it is there; returns why it cannot be had, or None."""
    path = problem.input(folder)
    folder.mkdir(parents=True, exist_ok=True)
    if problem.side:
        if not path.exists():
            pose_graph.write(path, grids.grid(problem.side))
        return None
    source = Path(data) / problem.file
    if not source.exists():
        return f"no {source}: docs/data.md says where data come from, MANIFACTOR_DATA where they lie"
    graph = pose_graph.read(source)
    if not graph.ids <= graph.vertices.keys():
        graph.vertices = ours.start(source, folder / f"{problem.name}.start.g2o") | graph.vertices
    pose_graph.write(path, graph)
    return None
