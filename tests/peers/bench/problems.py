"""The problems and their inputs: every method gets the same file, with an initial value for every pose."""

import shutil
from dataclasses import dataclass
from pathlib import Path

from bench import bundles, grids, pose_graph


POINTS_PER_CAMERA, OBSERVATIONS_PER_POINT = 100, 5  # of a bundle adjustment
HERE = Path(__file__).resolve().parent.parent
ROOT = HERE.parent.parent


@dataclass
class Problem:
    name: str
    kind: str  # se2, se3, grid, quadrics or bundle
    file: str = ""  # below the folder of data
    best_known: float | None = None  # of 1/2 sum r' Omega r, where it was found before
    side: int = 0  # of a grid
    cameras: int = 0  # of a bundle adjustment
    document: Path | None = None  # of a run that makes a scene
    variant: str = ""  # of that run

    def input(self, folder):
        suffix = {"quadrics": "json", "bundle": "bal"}.get(self.kind, "g2o")
        return folder / f"{self.name}.{suffix}"

    @property
    def size(self):
        """Returns the size for growth: poses of a grid, cameras of a bundle adjustment."""
        return self.side**3 or self.cameras


PUBLISHED = [
    Problem("M3500", "se2", "g2o/input_M3500_g2o.g2o", 68.957439123),
    Problem("intel", "se2", "g2o/intel.g2o", 22.50212),
    Problem("INTEL", "se2", "g2o/input_INTEL_g2o.g2o", 107.919),
    Problem("CSAIL", "se2", "g2o/CSAIL.g2o", 20.275441672),
    Problem("MIT", "se2", "g2o/MIT.g2o", 20.603473520),
    Problem("kitti_00", "se2", "g2o/kitti_00.g2o", 49.161069116),
    Problem("manhattan", "se2", "g2o/manhattan.g2o", 1774.520535),
    Problem("sphere2500", "se3", "g2o/sphere2500.g2o", 675.700962927),
    Problem("parking-garage", "se3", "g2o/parking-garage.g2o", 0.634192399632),
    Problem("torus3D", "se3", "g2o/torus3D.g2o", 12117.636879),
    Problem("smallGrid3D", "se3", "g2o/smallGrid3D.g2o", 517.92533236),
]


TUM = ROOT / "examples" / "tum"
SCENES = [
    Problem("fifty_objects", "quadrics", document=HERE / "scene.toml", variant="boxes"),
    Problem("fr2_desk", "quadrics", best_known=1583.24668, document=TUM / "fr2_desk.toml", variant="q"),
]


# 5,000 points, 25,000 observations
BUNDLES = [Problem("bundle", "bundle", cameras=50)]


NAMED = PUBLISHED + SCENES + BUNDLES


def bundle(cameras):
    return Problem(f"bundle_{cameras}", "bundle", cameras=cameras)


def grid(poses):
    """Returns a cube of about `poses` poses."""
    side = round(poses ** (1.0 / 3.0))
    return Problem(f"grid_{side**3}", "grid", side=side)


def prepare(problem, data, folder, ours):
    """Writes the input. Returns None, or the reason if it is not available."""
    folder.mkdir(parents=True, exist_ok=True)
    if problem.kind == "grid":
        return prepare_grid(problem, folder)
    if problem.kind == "bundle":
        return prepare_bundle(problem, folder)
    if problem.kind == "quadrics":
        return prepare_scene(problem, data, folder, ours)
    source = Path(data) / problem.file
    if not source.exists():
        return f"no {source}: docs/data.md says where data come from, MANIFACTOR_DATA where they lie"
    graph = pose_graph.read(source)
    if not graph.ids <= graph.vertices.keys():
        graph.vertices = ours.start(source, folder / f"{problem.name}.start.g2o") | graph.vertices
    pose_graph.write(problem.input(folder), graph)
    return None


def prepare_grid(problem, folder):
    if not problem.input(folder).exists():
        pose_graph.write(problem.input(folder), grids.grid(problem.side))


def prepare_bundle(problem, folder):
    lines = bundles.bundle(problem.cameras, POINTS_PER_CAMERA * problem.cameras, OBSERVATIONS_PER_POINT)
    problem.input(folder).write_text("\n".join(lines) + "\n")


def prepare_scene(problem, data, folder, ours):
    graph = folder / problem.name / problem.variant / "graph.json"
    graph.unlink(missing_ok=True)
    failed = ours.begin(problem.document, folder / problem.name, data)
    if not graph.exists():
        return failed
    shutil.copy(graph, problem.input(folder))
    return None
