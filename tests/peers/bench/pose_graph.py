"""Pose graphs in g2o's format, as lines: the common input of all adapters."""

from dataclasses import dataclass, field
from pathlib import Path

WIDTH = {"VERTEX_SE2": 3, "VERTEX_SE3:QUAT": 7}


@dataclass
class PoseGraph:
    spatial: bool
    vertices: dict[int, list[float]] = field(default_factory=dict)
    edges: list[list[str]] = field(default_factory=list)

    @property
    def ids(self):
        """Returns the ids of all poses in edges."""
        return {int(i) for edge in self.edges for i in edge[1:3]}


def read(path):
    """Reads vertices and edges. All remaining lines (FIX, parameters) are left to the adapters'
    convention."""
    graph = PoseGraph(spatial=False)
    for line in Path(path).read_text().splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] in WIDTH:
            graph.vertices[int(words[1])] = [float(x) for x in words[2:]]
        elif words[0].startswith("EDGE_SE"):
            graph.spatial = words[0] == "EDGE_SE3:QUAT"
            graph.edges.append(words)
    return graph


def write(path, graph):
    """Writes vertices by number, then edges, with fields separated by one space and no additional lines, so
    that every reader accepts it."""
    tag = "VERTEX_SE3:QUAT" if graph.spatial else "VERTEX_SE2"
    with open(path, "w") as out:
        for number, pose in sorted(graph.vertices.items()):
            print(tag, number, *(repr(x) for x in pose), file=out)
        for edge in graph.edges:
            print(*edge, file=out)
