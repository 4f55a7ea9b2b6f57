"""Solves a pose graph from a g2o file and writes the estimate: `python pose3_slam.py GRAPH.g2o`."""

import sys
from pathlib import Path

import manifactor as mf

path = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "helix.g2o"
graph, values = mf.load(path)
print(graph, "cost", graph.cost(values))
solution = mf.solve(graph, values)
print(solution)
mf.save("out/estimate.g2o", graph, solution.values, force=True)
