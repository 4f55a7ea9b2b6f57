"""Velocities and biases of an IMU, from its samples and from a pose each half second."""

from pathlib import Path

import manifactor as mf
import numpy as np

FLIGHT = Path(__file__).parents[1] / "flight"
samples = np.loadtxt(FLIGHT / "imu.csv", delimiter=",")  # ns, rad/s, m/s²
truth = np.loadtxt(FLIGHT / "truth.csv", delimiter=",")[::10]  # s, position, quaternion (w, x, y, z)
seconds = samples[:, 0] * 1e-9

graph, values = mf.Graph(), mf.Values()
for i, (_, *position, w, x, y, z) in enumerate(truth):
    pose = mf.Se3(translation=position, rotation=[x, y, z, w])
    graph.add(mf.prior(i, pose, sigmas=[0.002] * 3 + [0.01] * 3))
    values.update({i: pose, ("v", i): mf.Velocity(linear=[0, 0, 0])})
    values["b", i] = mf.ImuBias(gyroscope=[0, 0, 0], accelerometer=[0, 0, 0])
for i, (start, end) in enumerate(zip(truth[:-1, 0], truth[1:, 0])):
    between = samples[(seconds > start - 1e-6) & (seconds < end - 1e-6)]
    motion = mf.imu(seconds=np.full(len(between), 0.005), gyroscope=between[:, 1:4], accelerometer=between[:, 4:])
    graph.add([i, ("v", i), ("b", i), i + 1, ("v", i + 1), ("b", i + 1)], motion)

solution = mf.solve(graph, values)
last = len(truth) - 1
print(solution)
print("velocity", solution.values["v", last].linear.round(3), "m/s")
print("bias", solution.values["b", last].to_dict())
print("σ of the bias", np.sqrt(np.diag(solution.covariances(("b", last))[f"b{last}"])).round(5))
