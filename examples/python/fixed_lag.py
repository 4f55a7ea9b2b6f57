"""Odometry from two sensors in a window of two seconds: older poses are marginalized."""

import manifactor as mf

smoother = mf.Smoother(window={"seconds": 2.0})
for i in range(13):
    seconds = 0.25 * i
    graph, values = mf.Graph(), mf.Values({i: mf.Se2(translation=[2 * seconds, 0], angle=0)})
    if i == 0:
        graph.add(mf.prior(0, mf.Se2.identity(), sigmas=[0.3, 0.3, 0.1]))
    else:
        graph.add(mf.between(i - 1, i, mf.Se2(translation=[0.61, -0.08], angle=0.02), sigmas=[0.1, 0.1, 0.05]))
        graph.add(mf.between(i - 1, i, mf.Se2(translation=[0.47, 0.03], angle=0.01), sigmas=[0.05, 0.05, 0.05]))
    smoother.set_time(seconds)
    smoother.push(graph, values)
    smoother.update()
    print(seconds, smoother[i], len(smoother), "poses in the window")
