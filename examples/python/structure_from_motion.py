"""Ten cameras on a circle see the corners of a cube."""

import itertools

import manifactor as mf
import numpy as np

CAMERA = mf.types.Camera(fx=500, fy=500, cx=320, cy=240, width=640, height=480)

points = 10.0 * np.array(list(itertools.product([-1, 1], repeat=3)))
circle = 2 * np.pi * np.arange(10) / 10
poses = [mf.Se3.look_at([40 * np.cos(a), 40 * np.sin(a), 10], [0, 0, 0]) for a in circle]

graph, values = mf.Graph(), mf.Values(dict(enumerate(poses)))
graph.add(mf.prior(0, poses[0], sigmas=[0.001] * 3 + [0.1] * 3))
graph.add(mf.prior(("p", 0), mf.Point3(position=points[0]), sigma=0.1))
random = np.random.default_rng(0)
for j, point in enumerate(points):
    values["p", j] = mf.Point3(position=point + random.normal(size=3))
    for i, pose in enumerate(poses):
        x, y, z = pose.inverse() @ point
        graph.add([i, ("p", j)], mf.projection(pixel=[500 * x / z + 320, 500 * y / z + 240], camera=CAMERA), sigma=1)

solution = mf.solve(graph, values)
print(solution)
print("largest error of a point:", max(abs(solution.values["p", j].position - p).max() for j, p in enumerate(points)), "m")
print("covariance of the first:", solution.covariances("p0")["p0"], sep="\n")
