import sys
from pathlib import Path

import gtsam
import numpy as np

path = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[3] / "examples" / "python" / "helix.g2o"
graph, values = gtsam.readG2o(str(path), True)
measured = gtsam.NonlinearFactorGraph(graph)
first = gtsam.noiseModel.Constrained.All(6)
graph.add(gtsam.PriorFactorPose3(values.keys()[0], values.atPose3(values.keys()[0]), first))
print("cost", graph.error(values))
result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
print("cost", graph.error(result))
gtsam.writeG2o(measured, result, "out/estimate.g2o")
