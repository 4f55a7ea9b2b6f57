import sys

import gtsam
import numpy as np
from gtsam.symbol_shorthand import L, X


def simulated(random=np.random.default_rng(3)):
    beacons, pose, odometry, ranges = random.uniform(-5, 25, (4, 2)), gtsam.Pose2(), [], []
    for i in range(400):
        distance, turn = 0.3, 0.05 * np.sin(i / 25)
        pose = pose.compose(gtsam.Pose2(distance, 0, turn))
        odometry.append([i + 1.0, distance + random.normal(0, 0.01), turn + random.normal(0, 0.002)])
        ranges.append([i + 1.5, i % 4, np.linalg.norm(beacons[i % 4] - pose.translation()) + random.normal(0, 0.3)])
    return np.array(odometry), np.array(ranges)


def plaza(odometry, ranges):
    return np.loadtxt(odometry), np.loadtxt(ranges)[:, [0, 2, 3]]


odometry, ranges = plaza(*sys.argv[1:]) if len(sys.argv) > 1 else simulated()
graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
values.insert(X(0), gtsam.Pose2())
graph.add(gtsam.NonlinearEqualityPose2(X(0), gtsam.Pose2()))
step_noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.05, 0.01, 0.02]))
huber = gtsam.noiseModel.mEstimator.Huber.Create(1.345)
range_noise = gtsam.noiseModel.Robust.Create(huber, gtsam.noiseModel.Isotropic.Sigma(1, 0.5))
pose = gtsam.Pose2()
for i, (_, distance, turn) in enumerate(odometry):
    step = gtsam.Pose2(distance, 0, turn)
    graph.add(gtsam.BetweenFactorPose2(X(i), X(i + 1), step, step_noise))
    pose = pose.compose(step)
    values.insert(X(i + 1), pose)
random = np.random.default_rng(0)
for beacon in np.unique(ranges[:, 1]).astype(int):
    values.insert(L(beacon), gtsam.Point2(random.normal(0, 10, 2)))
poses = np.searchsorted(odometry[:, 0], ranges[:, 0])
for pose, (_, beacon, distance) in zip(poses, ranges):
    graph.add(gtsam.RangeFactor2D(X(pose), L(int(beacon)), distance, range_noise))

result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
print("cost", graph.error(result))
for beacon in np.unique(ranges[:, 1]).astype(int):
    print("beacon", beacon, "at", result.atPoint2(L(beacon)).round(2))
