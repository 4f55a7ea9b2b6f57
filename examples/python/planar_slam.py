"""A robot in the plane measures direction and distance of two landmarks."""

import manifactor as mf
import numpy as np

graph = mf.Graph()
graph.add(mf.prior(1, mf.Se2.identity(), sigmas=[0.3, 0.3, 0.1]))
for i in (1, 2):
    graph.add(mf.between(i, i + 1, mf.Se2(translation=[2, 0], angle=0), sigmas=[0.2, 0.2, 0.1]))
for pose, landmark, degrees, distance in [(1, 1, 45, np.sqrt(8)), (2, 1, 90, 2), (3, 2, 90, 2)]:
    seen = mf.bearing_range_se2(bearing=np.deg2rad(degrees), range=distance)
    graph.add([pose, ("l", landmark)], seen, sigmas=[0.1, 0.2])

values = mf.Values({("l", 1): mf.Point2(position=[1.8, 2.1]), ("l", 2): mf.Point2(position=[4.1, 1.8])})
for i, (x, y, a) in enumerate([(-0.25, 0.2, 0.15), (2.3, 0.1, -0.2), (4.1, 0.1, 0.1)], start=1):
    values[i] = mf.Se2(translation=[x, y], angle=a)

solution = mf.solve(graph, values)
for key, value in solution.values.items():
    print(key, value, "σ", np.sqrt(np.diag(solution.covariances(key)[key])).round(3))
