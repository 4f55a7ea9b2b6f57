"""A robot finds its path on a known map: the landmarks are fixed."""

import manifactor as mf
import numpy as np

random = np.random.default_rng(1)
landmarks = random.uniform([-5, -5], [25, 15], (12, 2))
steps = mf.Se2.exp(np.tile([1.0, 0, 0.1], (20, 1)))

graph, values, pose, guess = mf.Graph(), mf.Values(), mf.Se2.identity(), mf.Se2.identity()
values.insert_many(np.arange(12), mf.Point2, {"position": landmarks}, prefix="l")
for j in range(12):
    graph.fix(("l", j))
for i in range(21):
    values[i] = guess
    seen = pose.inverse() @ landmarks
    for j in np.flatnonzero(np.linalg.norm(seen, axis=1) < 8).tolist():
        bearing = np.arctan2(seen[j, 1], seen[j, 0]) + random.normal(0, 0.02)
        distance = np.linalg.norm(seen[j]) + random.normal(0, 0.1)
        graph.add([i, ("l", j)], mf.bearing_range_se2(bearing=bearing, range=distance), sigmas=[0.02, 0.1])
    if i < 20:
        measured = steps[i] * mf.Se2.exp(random.normal(0, [0.1, 0.1, 0.05]))
        graph.add(mf.between(i, i + 1, measured, sigmas=[0.1, 0.1, 0.05]))
        pose, guess = pose * steps[i], guess * measured

solution = mf.solve(graph, values)
print(solution)
print("error of the odometry", np.linalg.norm(guess.translation - pose.translation).round(4), "m")
print("error of the estimate", np.linalg.norm(solution.values[20].translation - pose.translation).round(4), "m")
