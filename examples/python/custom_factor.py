"""A factor of your own, as a function: position measurements for a robot with odometry."""

import manifactor as mf


@mf.factor
def position(x: mf.Se2, measured):
    return x.translation - measured


graph, values = mf.Graph(), mf.Values()
for i in range(3):
    values[i] = mf.Se2(translation=[2.2 * i + 0.3, 0.1 * i], angle=0.2 - 0.1 * i)
    graph.add(i, position(measured=[2.0 * i, 0]), sigma=0.1)
for i in range(2):
    graph.add(mf.between(i, i + 1, mf.Se2(translation=[2, 0], angle=0), sigmas=[0.2, 0.2, 0.1]))

solution = mf.solve(graph, values)
for key, value in solution.values.items():
    print(key, value)
