"""A stereo camera moves by a metre. The factor is a function: nothing but its residual is written."""

import manifactor as mf


@mf.factor
def stereo(camera: mf.Se3, point: mf.Point3, measured, focal=1000.0, cx=320.0, cy=240.0, baseline=0.2):
    """The point is seen at (u left, u right, v), in pixels."""
    x, y, z = camera.inverse() * point
    return [
        cx + focal * x / z - measured[0],
        cx + focal * (x - baseline) / z - measured[1],
        cy + focal * y / z - measured[2],
    ]


graph = mf.Graph()
graph.fix("x1")
for pose, landmark, measured in [
    ("x1", "l1", [520, 480, 440]), ("x1", "l2", [120, 80, 440]), ("x1", "l3", [320, 280, 140]),
    ("x2", "l1", [570, 520, 490]), ("x2", "l2", [70, 20, 490]), ("x2", "l3", [320, 270, 115]),
]:  # fmt: skip
    graph.add([pose, landmark], stereo(measured=measured), sigma=1)

values = mf.Values({"x1": mf.Se3.identity(), "x2": mf.Se3(translation=[0.1, -0.1, 1.1], rotation=[0, 0, 0, 1])})
values.update({f"l{i}": mf.Point3(position=p) for i, p in enumerate([(1, 1, 5), (-1, 1, 5), (0, -0.5, 5)], start=1)})

solution = mf.solve(graph, values)
print(solution)
print(solution.values["x2"])
