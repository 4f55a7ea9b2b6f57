import sys
from pathlib import Path

import gtsam
import numpy as np
from gtsam.symbol_shorthand import B, V, X


def flight():
    folder = Path(__file__).parents[3] / "examples" / "flight"
    samples = np.loadtxt(folder / "imu.csv", delimiter=",") * ([1e-9] + [1] * 6)
    fixes = np.loadtxt(folder / "truth.csv", delimiter=",")[::10, :4]
    fixes[:, 1:] += np.random.default_rng(0).normal(0, 0.05, (len(fixes), 3))
    return samples, fixes, 0.05, (1.7e-4, 2e-3, 2e-5, 3e-3)


def kitti(imu, gps):
    table = np.loadtxt(imu, skiprows=1)
    fixes = np.loadtxt(gps, skiprows=1, delimiter=",")[1:]
    return table[:, [0, 5, 6, 7, 2, 3, 4]], fixes, 0.07**0.5, (1.75e-4, 0.01, 2.9e-6, 1.67e-4)


samples, fixes, sigma, densities = kitti(*sys.argv[1:]) if len(sys.argv) > 1 else flight()
params = gtsam.PreintegrationCombinedParams.MakeSharedU(9.81)
params.setGyroscopeCovariance(np.eye(3) * densities[0] ** 2)
params.setAccelerometerCovariance(np.eye(3) * densities[1] ** 2)
params.setBiasOmegaCovariance(np.eye(3) * densities[2] ** 2)
params.setBiasAccCovariance(np.eye(3) * densities[3] ** 2)
params.setIntegrationCovariance(np.eye(3) * 1e-12)
graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
noise = gtsam.noiseModel.Isotropic.Sigma(3, sigma)
for i, (_, *position) in enumerate(fixes):
    values.insert(X(i), gtsam.Pose3(gtsam.Rot3(), gtsam.Point3(*position)))
    values.insert(V(i), np.zeros(3))
    values.insert(B(i), gtsam.imuBias.ConstantBias())
    graph.add(gtsam.GPSFactor(X(i), gtsam.Point3(*position), noise))
bias_noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.1] * 3 + [0.01] * 3))
graph.add(gtsam.PriorFactorConstantBias(B(0), gtsam.imuBias.ConstantBias(), bias_noise))
for i in range(len(fixes) - 1):
    first, last = np.searchsorted(samples[:, 0], fixes[i : i + 2, 0])
    times = np.clip(samples[first : last + 1, 0], *fixes[i : i + 2, 0])
    motion = gtsam.PreintegratedCombinedMeasurements(params, gtsam.imuBias.ConstantBias())
    for sample, duration in zip(samples[first:last], np.diff(times)):
        if duration > 0:
            motion.integrateMeasurement(sample[4:], sample[1:4], duration)
    graph.add(gtsam.CombinedImuFactor(X(i), V(i), X(i + 1), V(i + 1), B(i), B(i + 1), motion))

result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
print("cost", graph.error(result))
positions = np.array([result.atPose3(X(i)).translation() for i in range(len(fixes))])
print("distance from the fixes, median", np.median(np.linalg.norm(positions - fixes[:, 1:], axis=1)).round(4), "m")
print("bias at the end", result.atConstantBias(B(len(fixes) - 1)))
