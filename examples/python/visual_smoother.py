"""Structure from motion, frame by frame: the estimate is updated after each of ten cameras."""

import itertools

import manifactor as mf
import numpy as np

CAMERA = mf.types.Camera(fx=500, fy=500, cx=320, cy=240, width=640, height=480)

points = 10.0 * np.array(list(itertools.product([-1, 1], repeat=3)))
circle = 2 * np.pi * np.arange(10) / 10
poses = [mf.Se3.look_at([40 * np.cos(a), 40 * np.sin(a), 10], [0, 0, 0]) for a in circle]
random = np.random.default_rng(0)

smoother = mf.Smoother()
for i, pose in enumerate(poses):
    graph, values = mf.Graph(), mf.Values({i: pose.retract(random.normal(0, [0.02] * 3 + [0.2] * 3))})
    if i == 0:
        graph.add(mf.prior(0, pose, sigmas=[0.001] * 3 + [0.1] * 3))
        graph.add(mf.prior(("p", 0), mf.Point3(position=points[0]), sigma=0.1))
        values.insert_many(np.arange(8), mf.Point3, {"position": points + random.normal(size=(8, 3))}, prefix="p")
    for j, (x, y, z) in enumerate(pose.inverse() @ points):
        graph.add([i, ("p", j)], mf.projection(pixel=[500 * x / z + 320, 500 * y / z + 240], camera=CAMERA), sigma=1)
    smoother.push(graph, values)
    if i == 0:
        continue  # one camera does not determine how far away the points are
    update = smoother.update()
    print(i, "redone", update["redone"], "cost", smoother.cost(), smoother[i])
