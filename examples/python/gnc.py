"""A pose graph with wrong loop closures, found by graduated non-convexity."""

import manifactor as mf
import numpy as np

random = np.random.default_rng(2)
corner = [mf.Se2(translation=[1, 0], angle=np.pi / 2 if i % 10 == 9 else 0) for i in range(80)]
graph, values, truth = mf.Graph(), mf.Values({0: mf.Se2.identity()}), [mf.Se2.identity()]
graph.fix(0)
for i, step in enumerate(corner):
    measured = step * mf.Se2.exp(random.normal(0, [0.05, 0.05, 0.01]))
    graph.add(mf.between(i, i + 1, measured, sigmas=[0.05, 0.05, 0.01]))
    values[i + 1] = values[i] * measured
    truth.append(truth[-1] * step)
for i in range(0, 40, 2):  # the second round passes the same places; every fourth closure is wrong
    shift = random.normal(0, [3, 3, 1] if i % 8 == 6 else [0.05, 0.05, 0.01])
    graph.add(mf.between(i, i + 40, mf.Se2.exp(shift), sigmas=[0.05, 0.05, 0.01]))

for solver in (mf.auto(), mf.gnc()):
    solution = mf.solve(graph, values, solver)
    errors = [np.linalg.norm(solution.values[i].translation - x.translation) for i, x in enumerate(truth)]
    rejected = [graph[at].keys for at in np.flatnonzero(solution.weights < 0.5)]
    print(solver.type, "largest error", np.max(errors).round(3), "m, rejected", rejected)
