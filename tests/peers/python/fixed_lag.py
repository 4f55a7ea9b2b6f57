import gtsam
import numpy as np

smoother = gtsam.BatchFixedLagSmoother(2.0)
prior = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.3, 0.3, 0.1]))
first = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.1, 0.1, 0.05]))
second = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.05, 0.05, 0.05]))
for i in range(13):
    seconds = 0.25 * i
    graph, values, stamps = gtsam.NonlinearFactorGraph(), gtsam.Values(), gtsam.FixedLagSmootherKeyTimestampMap()
    values.insert(i, gtsam.Pose2(2 * seconds, 0, 0))
    stamps.insert((i, seconds))
    if i == 0:
        graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(), prior))
    else:
        graph.add(gtsam.BetweenFactorPose2(i - 1, i, gtsam.Pose2(0.61, -0.08, 0.02), first))
        graph.add(gtsam.BetweenFactorPose2(i - 1, i, gtsam.Pose2(0.47, 0.03, 0.01), second))
    smoother.update(graph, values, stamps)
    print(seconds, smoother.calculateEstimatePose2(i))
