from functools import partial

import gtsam
import numpy as np


def position(measured, this, values, jacobians):
    x = values.atPose2(this.keys()[0])
    if jacobians is not None:
        jacobians[0] = np.hstack([x.rotation().matrix(), np.zeros((2, 1))])
    return x.translation() - measured


graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
fix = gtsam.noiseModel.Isotropic.Sigma(2, 0.1)
odometry = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.2, 0.2, 0.1]))
for i in range(3):
    values.insert(i, gtsam.Pose2(2.2 * i + 0.3, 0.1 * i, 0.2 - 0.1 * i))
    graph.add(gtsam.CustomFactor(fix, [i], partial(position, np.array([2.0 * i, 0]))))
for i in range(2):
    graph.add(gtsam.BetweenFactorPose2(i, i + 1, gtsam.Pose2(2, 0, 0), odometry))

result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
for i in range(3):
    print(i, result.atPose2(i))
