import gtsam
import numpy as np
from gtsam.symbol_shorthand import L, X

random = np.random.default_rng(1)
landmarks = random.uniform([-5, -5], [25, 15], (12, 2))
step = gtsam.Pose2.Expmap(np.array([1.0, 0, 0.1]))

graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
odometry = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.1, 0.1, 0.05]))
sighting = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.02, 0.1]))
for j, landmark in enumerate(landmarks):
    values.insert(L(j), gtsam.Point2(landmark))
    graph.add(gtsam.NonlinearEqualityPoint2(L(j), gtsam.Point2(landmark)))
pose, guess = gtsam.Pose2(), gtsam.Pose2()
for i in range(21):
    values.insert(X(i), guess)
    seen = pose.transformTo(landmarks.T).T
    for j in np.flatnonzero(np.linalg.norm(seen, axis=1) < 8):
        bearing = gtsam.Rot2(np.arctan2(seen[j, 1], seen[j, 0]) + random.normal(0, 0.02))
        distance = np.linalg.norm(seen[j]) + random.normal(0, 0.1)
        graph.add(gtsam.BearingRangeFactor2D(X(i), L(j), bearing, distance, sighting))
    if i < 20:
        measured = step.compose(gtsam.Pose2.Expmap(random.normal(0, [0.1, 0.1, 0.05])))
        graph.add(gtsam.BetweenFactorPose2(X(i), X(i + 1), measured, odometry))
        pose, guess = pose.compose(step), guess.compose(measured)

result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
print("cost", graph.error(result))
print("error of the odometry", np.linalg.norm(guess.translation() - pose.translation()).round(4), "m")
print("error of the estimate", np.linalg.norm(result.atPose2(X(20)).translation() - pose.translation()).round(4), "m")
