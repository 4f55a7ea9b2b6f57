import itertools

import gtsam
import numpy as np
from gtsam.symbol_shorthand import P, X

K = gtsam.Cal3_S2(500, 500, 0, 320, 240)
points = 10.0 * np.array(list(itertools.product([-1, 1], repeat=3)))
cameras = []
for a in 2 * np.pi * np.arange(10) / 10:
    position = gtsam.Point3(40 * np.cos(a), 40 * np.sin(a), 10)
    cameras.append(gtsam.PinholeCameraCal3_S2.Lookat(position, gtsam.Point3(0, 0, 0), gtsam.Point3(0, 0, 1), K))

graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
pose_noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.001] * 3 + [0.1] * 3))
point_noise = gtsam.noiseModel.Isotropic.Sigma(3, 0.1)
pixel_noise = gtsam.noiseModel.Isotropic.Sigma(2, 1)
graph.add(gtsam.PriorFactorPose3(X(0), cameras[0].pose(), pose_noise))
graph.add(gtsam.PriorFactorPoint3(P(0), gtsam.Point3(points[0]), point_noise))
for i, camera in enumerate(cameras):
    values.insert(X(i), camera.pose())
random = np.random.default_rng(0)
for j, point in enumerate(points):
    values.insert(P(j), gtsam.Point3(point + random.normal(size=3)))
    for i, camera in enumerate(cameras):
        graph.add(gtsam.GenericProjectionFactorCal3_S2(camera.project(point), pixel_noise, X(i), P(j), K))

result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
print("cost", graph.error(result))
print(max(abs(result.atPoint3(P(j)) - p).max() for j, p in enumerate(points)))
print(gtsam.Marginals(graph, result).marginalCovariance(P(0)))
