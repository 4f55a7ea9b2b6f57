from pathlib import Path

import gtsam
import numpy as np
from gtsam.symbol_shorthand import B, V, X

FLIGHT = Path(__file__).parents[3] / "examples" / "flight"
samples = np.loadtxt(FLIGHT / "imu.csv", delimiter=",")
truth = np.loadtxt(FLIGHT / "truth.csv", delimiter=",")[::10]
seconds = samples[:, 0] * 1e-9

params = gtsam.PreintegrationCombinedParams.MakeSharedU(9.81)
params.setGyroscopeCovariance(np.eye(3) * 1.7e-4**2)
params.setAccelerometerCovariance(np.eye(3) * 2e-3**2)
params.setBiasOmegaCovariance(np.eye(3) * 2e-5**2)
params.setBiasAccCovariance(np.eye(3) * 3e-3**2)
params.setIntegrationCovariance(np.eye(3) * 1e-12)
graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.002] * 3 + [0.01] * 3))
for i, (_, *position, w, x, y, z) in enumerate(truth):
    pose = gtsam.Pose3(gtsam.Rot3.Quaternion(w, x, y, z), gtsam.Point3(*position))
    graph.add(gtsam.PriorFactorPose3(X(i), pose, noise))
    values.insert(X(i), pose)
    values.insert(V(i), np.zeros(3))
    values.insert(B(i), gtsam.imuBias.ConstantBias())
for i, (start, end) in enumerate(zip(truth[:-1, 0], truth[1:, 0])):
    motion = gtsam.PreintegratedCombinedMeasurements(params, gtsam.imuBias.ConstantBias())
    for sample in samples[(seconds > start - 1e-6) & (seconds < end - 1e-6)]:
        motion.integrateMeasurement(sample[4:], sample[1:4], 0.005)
    graph.add(gtsam.CombinedImuFactor(X(i), V(i), X(i + 1), V(i + 1), B(i), B(i + 1), motion))

result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
last = len(truth) - 1
print("cost", graph.error(result))
print("velocity", result.atVector(V(last)).round(3), "m/s")
print("bias", result.atConstantBias(B(last)))
print(np.sqrt(np.diag(gtsam.Marginals(graph, result).marginalCovariance(B(last)))).round(5))
