import gtsam
import numpy as np

graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
prior = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.3, 0.3, 0.1]))
noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.2, 0.2, 0.1]))
graph.add(gtsam.PriorFactorPose2(1, gtsam.Pose2(0, 0, 0), prior))
for i, turn in enumerate([0, np.pi / 2, np.pi / 2, np.pi / 2], start=1):
    graph.add(gtsam.BetweenFactorPose2(i, i + 1, gtsam.Pose2(2, 0, turn), noise))
graph.add(gtsam.BetweenFactorPose2(5, 2, gtsam.Pose2(2, 0, np.pi / 2), noise))

guesses = [(0.5, 0, 0.2), (2.3, 0.1, -0.2), (4.1, 0.1, np.pi / 2), (4, 2, np.pi), (2.1, 2.1, -np.pi / 2)]
for i, (x, y, a) in enumerate(guesses, start=1):
    values.insert(i, gtsam.Pose2(x, y, a))

result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
marginals = gtsam.Marginals(graph, result)
for i in range(1, 6):
    print(result.atPose2(i), np.sqrt(np.diag(marginals.marginalCovariance(i))).round(3))
