import gtsam
import numpy as np
from gtsam.symbol_shorthand import L, X

graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
prior = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.3, 0.3, 0.1]))
odometry = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.2, 0.2, 0.1]))
sighting = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.1, 0.2]))
graph.add(gtsam.PriorFactorPose2(X(1), gtsam.Pose2(0, 0, 0), prior))
for i in (1, 2):
    graph.add(gtsam.BetweenFactorPose2(X(i), X(i + 1), gtsam.Pose2(2, 0, 0), odometry))
for pose, landmark, degrees, distance in [(1, 1, 45, np.sqrt(8)), (2, 1, 90, 2), (3, 2, 90, 2)]:
    bearing = gtsam.Rot2.fromDegrees(degrees)
    graph.add(gtsam.BearingRangeFactor2D(X(pose), L(landmark), bearing, distance, sighting))

values.insert(L(1), gtsam.Point2(1.8, 2.1))
values.insert(L(2), gtsam.Point2(4.1, 1.8))
for i, (x, y, a) in enumerate([(-0.25, 0.2, 0.15), (2.3, 0.1, -0.2), (4.1, 0.1, 0.1)], start=1):
    values.insert(X(i), gtsam.Pose2(x, y, a))

result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
marginals = gtsam.Marginals(graph, result)
for i in (1, 2, 3):
    print("x", i, result.atPose2(X(i)), np.sqrt(np.diag(marginals.marginalCovariance(X(i)))).round(3))
for i in (1, 2):
    print("l", i, result.atPoint2(L(i)), np.sqrt(np.diag(marginals.marginalCovariance(L(i)))).round(3))
