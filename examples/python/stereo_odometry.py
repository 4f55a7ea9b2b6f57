"""A stereo camera moves by a metre. Three points have a place in the left image, and an x in the right one."""

import manifactor as mf

CAMERA = mf.types.Camera(fx=1000, fy=1000, cx=320, cy=240, width=640, height=480)

graph = mf.Graph()
graph.fix("x1")
for pose, landmark, left, right, row in [
    ("x1", "l1", 520, 480, 440), ("x1", "l2", 120, 80, 440), ("x1", "l3", 320, 280, 140),
    ("x2", "l1", 570, 520, 490), ("x2", "l2", 70, 20, 490), ("x2", "l3", 320, 270, 115),
]:  # fmt: skip
    graph.add([pose, landmark], mf.stereo(pixel=[left, row], right=right, baseline=0.2, camera=CAMERA), sigma=1)

values = mf.Values({"x1": mf.Se3.identity(), "x2": mf.Se3(translation=[0.1, -0.1, 1.1], rotation=[0, 0, 0, 1])})
values.update({f"l{i}": mf.Point3(position=p) for i, p in enumerate([(1, 1, 5), (-1, 1, 5), (0, -0.5, 5)], start=1)})

solution = mf.solve(graph, values)
print(solution)
print(solution.values["x2"])
