"""Wheel odometry and GNSS in the plane: the formula of the wheels has the track width as a variable, which GNSS determines."""

import manifactor as mf
import numpy as np


@mf.factor
def wheels(a: mf.Se2, b: mf.Se2, track: mf.Point1, left, right):
    """The wheels roll over arcs of these lengths, in metres, without slip. Rows: forward, left, turn."""
    turn = (right - left) / track
    step = a.inverse() * b
    ahead = (left + right) / 2  # to second order, the chord points along half of the turn
    return [step.translation - [ahead * np.cos(turn / 2), ahead * np.sin(turn / 2)], step.angle - turn]


@mf.factor
def gnss(x: mf.Se2, measured, antenna):
    """The antenna, at this place on the robot, is at `measured`."""
    return x * antenna - measured


random, width, antenna = np.random.default_rng(4), 0.62, np.array([0.3, 0.1])
graph, values, truth = mf.Graph(), mf.Values({0: mf.Se2.identity(), "track": mf.Point1(position=[0.5])}), [mf.Se2.identity()]
for i in range(200):
    left, right = 0.2 + 0.05 * np.sin(i / 9), 0.2 + 0.05 * np.cos(i / 7)
    ahead, turn = (left + right) / 2, (right - left) / width
    truth.append(truth[i] * mf.Se2(translation=[ahead * np.cos(turn / 2), ahead * np.sin(turn / 2)], angle=turn))
    left, right = random.normal([left, right], 0.002)
    graph.add([i, i + 1, "track"], wheels(left=left, right=right), sigmas=[0.002, 0.002, 0.005])
    values[i + 1] = values[i] * mf.Se2(translation=[(left + right) / 2, 0], angle=(right - left) / 0.5)
    if i % 10 == 0:
        measured = truth[i] * antenna + random.normal(0, 0.5, 2)
        graph.add(i, gnss(measured=measured, antenna=antenna), sigma=0.5, loss=mf.huber())

solution = mf.solve(graph, values)
print(solution)
sigma = solution.covariances("track")["track"][0, 0] ** 0.5
print("track width", solution.values["track"].position.round(4), "±", sigma.round(4), "m, true", width)
print("error of the last pose", np.linalg.norm(solution.values[200].translation - truth[200].translation).round(3), "m")
