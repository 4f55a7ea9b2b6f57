"""The cost of an estimate, 1/2 sum r' Omega r, logarithms in full, independent of every solver under test.

    referee INPUT ESTIMATE...      prints a JSON list: the cost at each estimate, null where variables are missing
"""

import json
import sys
from pathlib import Path

import numpy as np

from bench import bal, pose_graph, scene
from bench.lie import Plane, Space, unit


class PoseGraphReferee:
    """r = Log(Z^-1 Xi^-1 Xj)."""

    def __init__(self, path):
        graph = pose_graph.read(path)
        self.spatial = graph.spatial
        self.group = Space if graph.spatial else Plane
        width, n = (7, 6) if graph.spatial else (3, 3)
        self.ids = np.array([[int(e[1]), int(e[2])] for e in graph.edges])
        numbers = np.array([[float(x) for x in e[3:]] for e in graph.edges])
        self.measured = unit(numbers[:, :width].copy(), graph.spatial)
        self.information = np.zeros((len(numbers), n, n))
        rows, columns = np.triu_indices(n)
        self.information[:, rows, columns] = numbers[:, width:]
        self.information[:, columns, rows] = numbers[:, width:]

    def cost(self, path):
        """Returns the cost, or None if a pose is missing or not finite."""
        vertices = pose_graph.read(path).vertices
        if not set(self.ids.flat) <= vertices.keys():
            return None
        x, y = (unit(np.array([vertices[i] for i in ends]), self.spatial) for ends in self.ids.T)
        r = self.group.log(self.group.between(self.measured, self.group.between(x, y)))
        cost = 0.5 * np.einsum("ni,nij,nj", r, self.information, r, optimize=True)
        return float(cost) if np.isfinite(cost) else None


if __name__ == "__main__":
    source, *estimates = sys.argv[1:]
    referees = {".json": scene.SceneReferee.open, ".bal": bal.BundleReferee}
    referee = referees.get(Path(source).suffix, PoseGraphReferee)(source)
    print(json.dumps([referee.cost(path) for path in estimates]))
