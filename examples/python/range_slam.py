"""A robot measures distances to beacons at unknown places: `python range_slam.py [DR.txt TD.txt]`, as of the Plaza data."""

import sys

import manifactor as mf
import numpy as np


def simulated(random=np.random.default_rng(3)):
    """Returns odometry as (seconds, distance, turn) and distances as (seconds, beacon, distance)."""
    beacons, pose, odometry, ranges = random.uniform(-5, 25, (4, 2)), mf.Se2.identity(), [], []
    for i in range(400):
        distance, turn = 0.3, 0.05 * np.sin(i / 25)
        pose *= mf.Se2(translation=[distance, 0], angle=turn)
        odometry.append([i + 1.0, distance + random.normal(0, 0.01), turn + random.normal(0, 0.002)])
        ranges.append([i + 1.5, i % 4, np.linalg.norm(beacons[i % 4] - pose.translation) + random.normal(0, 0.3)])
    return np.array(odometry), np.array(ranges)


def plaza(odometry, ranges):
    return np.loadtxt(odometry), np.loadtxt(ranges)[:, [0, 2, 3]]


odometry, ranges = plaza(*sys.argv[1:]) if len(sys.argv) > 1 else simulated()
graph, values = mf.Graph(), mf.Values({0: mf.Se2.identity()})
graph.fix(0)
for i, (_, distance, turn) in enumerate(odometry):
    step = mf.Se2(translation=[distance, 0], angle=turn)
    graph.add(mf.between(i, i + 1, step, sigmas=[0.05, 0.01, 0.02]))
    values[i + 1] = values[i] * step
random = np.random.default_rng(0)
for beacon in np.unique(ranges[:, 1]).astype(int):
    values["l", beacon] = mf.Point2(position=random.normal(0, 10, 2))
poses = np.searchsorted(odometry[:, 0], ranges[:, 0])
keys = np.stack([poses, ranges[:, 1]], axis=1).astype(int)
graph.add_many(mf.range_se2_point2, keys, {"range": ranges[:, 2]}, prefix=["x", "l"], noise=0.5, loss=mf.huber())

solution = mf.solve(graph, values)
print(solution)
for beacon in np.unique(keys[:, 1]):
    print("beacon", beacon, "at", solution.values["l", beacon].position.round(2))
