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
random = np.random.default_rng(0)

isam = gtsam.ISAM2()
pose_noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.001] * 3 + [0.1] * 3))
point_noise = gtsam.noiseModel.Isotropic.Sigma(3, 0.1)
pixel_noise = gtsam.noiseModel.Isotropic.Sigma(2, 1)
for i, camera in enumerate(cameras):
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    values.insert(X(i), camera.pose().retract(random.normal(0, [0.02] * 3 + [0.2] * 3)))
    if i == 0:
        graph.add(gtsam.PriorFactorPose3(X(0), camera.pose(), pose_noise))
        graph.add(gtsam.PriorFactorPoint3(P(0), gtsam.Point3(points[0]), point_noise))
        for j, point in enumerate(points + random.normal(size=(8, 3))):
            values.insert(P(j), gtsam.Point3(point))
    for j, point in enumerate(points):
        graph.add(gtsam.GenericProjectionFactorCal3_S2(camera.project(point), pixel_noise, X(i), P(j), K))
    if i == 0:
        waiting, guesses = graph, values
        continue
    if i == 1:
        graph.push_back(waiting)
        values.insert(guesses)
    isam.update(graph, values)
    estimate = isam.calculateEstimate()
    print(i, "cost", isam.getFactorsUnsafe().error(estimate), estimate.atPose3(X(i)))
