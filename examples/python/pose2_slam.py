"""A robot drives a square, and a loop closure corrects its odometry."""

import manifactor as mf
import numpy as np

graph = mf.Graph()
graph.add(mf.prior(1, mf.Se2.identity(), sigmas=[0.3, 0.3, 0.1]))
for i, turn in enumerate([0, np.pi / 2, np.pi / 2, np.pi / 2], start=1):
    graph.add(mf.between(i, i + 1, mf.Se2(translation=[2, 0], angle=turn), sigmas=[0.2, 0.2, 0.1]))
graph.add(mf.between(5, 2, mf.Se2(translation=[2, 0], angle=np.pi / 2), sigmas=[0.2, 0.2, 0.1]))

guesses = [(0.5, 0, 0.2), (2.3, 0.1, -0.2), (4.1, 0.1, np.pi / 2), (4, 2, np.pi), (2.1, 2.1, -np.pi / 2)]
values = mf.Values({i: mf.Se2(translation=[x, y], angle=a) for i, (x, y, a) in enumerate(guesses, start=1)})

solution = mf.solve(graph, values)
for i in range(1, 6):
    print(solution.values[i], "σ", np.sqrt(np.diag(solution.covariances(i)[f"x{i}"])).round(3))
