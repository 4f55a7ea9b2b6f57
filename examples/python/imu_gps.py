"""A trajectory from an IMU and positions: `python imu_gps.py [IMU.txt GPS.txt]`, in the form of GTSAM's KITTI files."""

import sys
from pathlib import Path

import manifactor as mf
import numpy as np


def flight():
    """Returns the samples and, each half second, a position with noise, of the simulated flight."""
    folder = Path(__file__).parents[1] / "flight"
    samples = np.loadtxt(folder / "imu.csv", delimiter=",") * ([1e-9] + [1] * 6)
    fixes = np.loadtxt(folder / "truth.csv", delimiter=",")[::10, :4]
    fixes[:, 1:] += np.random.default_rng(0).normal(0, 0.05, (len(fixes), 3))
    return samples, fixes, 0.05, None


def kitti(imu, gps):
    """Returns samples as (seconds, rates, forces), positions as (seconds, x, y, z), σ in m, and the IMU's noise."""
    table = np.loadtxt(imu, skiprows=1)
    noise = mf.types.ImuDensities(gyroscope=1.75e-4, accelerometer=0.01, gyroscope_walk=2.9e-6, accelerometer_walk=1.67e-4)
    return table[:, [0, 5, 6, 7, 2, 3, 4]], np.loadtxt(gps, skiprows=1, delimiter=",")[1:], 0.07**0.5, noise


samples, fixes, sigma, noise = kitti(*sys.argv[1:]) if len(sys.argv) > 1 else flight()
graph, values = mf.Graph(), mf.Values()
for i, (_, *position) in enumerate(fixes):
    values[i] = mf.Se3(translation=position, rotation=[0, 0, 0, 1])
    values["v", i] = mf.Velocity(linear=[0, 0, 0])
    values["b", i] = mf.ImuBias(gyroscope=[0, 0, 0], accelerometer=[0, 0, 0])
    graph.add(i, mf.position_se3(position=position), sigma=sigma)
graph.add(mf.prior(("b", 0), values["b", 0], sigmas=[0.01] * 3 + [0.1] * 3))
for i in range(len(fixes) - 1):
    first, last = np.searchsorted(samples[:, 0], fixes[i : i + 2, 0])
    times = np.clip(samples[first : last + 1, 0], *fixes[i : i + 2, 0])
    rows = samples[first:last][np.diff(times) > 0]
    motion = mf.imu(seconds=np.diff(times)[np.diff(times) > 0], gyroscope=rows[:, 1:4], accelerometer=rows[:, 4:], noise=noise)
    graph.add([i, ("v", i), ("b", i), i + 1, ("v", i + 1), ("b", i + 1)], motion)

solution = mf.solve(graph, values)
print(solution)
positions = np.array([solution.values[i].translation for i in range(len(fixes))])
print("distance from the fixes, median", np.median(np.linalg.norm(positions - fixes[:, 1:], axis=1)).round(4), "m")
print("bias at the end", solution.values["b", len(fixes) - 1].to_dict())
