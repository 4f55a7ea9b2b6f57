import gtsam
import numpy as np
from gtsam.symbol_shorthand import L, X

graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
graph.add(gtsam.NonlinearEqualityPose3(X(1), gtsam.Pose3()))
K = gtsam.Cal3_S2Stereo(1000, 1000, 0, 320, 240, 0.2)
noise = gtsam.noiseModel.Isotropic.Sigma(3, 1)
for pose, landmark, measured in [
    (1, 1, (520, 480, 440)), (1, 2, (120, 80, 440)), (1, 3, (320, 280, 140)),
    (2, 1, (570, 520, 490)), (2, 2, (70, 20, 490)), (2, 3, (320, 270, 115)),
]:  # fmt: skip
    graph.add(gtsam.GenericStereoFactor3D(gtsam.StereoPoint2(*measured), noise, X(pose), L(landmark), K))

values.insert(X(1), gtsam.Pose3())
values.insert(X(2), gtsam.Pose3(gtsam.Rot3(), gtsam.Point3(0.1, -0.1, 1.1)))
for i, p in enumerate([(1, 1, 5), (-1, 1, 5), (0, -0.5, 5)], start=1):
    values.insert(L(i), gtsam.Point3(*p))

result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
print("cost", graph.error(result))
print(result.atPose3(X(2)))
