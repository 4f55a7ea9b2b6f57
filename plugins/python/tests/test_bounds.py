"""Bounds and constraints, beside SciPy."""

import copy
import pickle
from typing import Any

import manifactor as mf
import numpy as np
import pytest

optimize = pytest.importorskip("scipy.optimize")


@mf.factor
def decay(a: mf.Point1, b: mf.Point1, c: mf.Point1, x: Any, y: Any) -> Any:
    return a * np.exp(-b * x) + c - y


def test_fits_within_bounds_agree_with_scipy() -> None:
    random = np.random.default_rng(7)
    names, active = ("a", "b", "c"), 0
    x = np.linspace(0, 4, 30)
    for _ in range(40):
        truth = random.uniform([1, 0.3, -1], [3, 2, 1])
        y = truth[0] * np.exp(-truth[1] * x) + truth[2] + random.normal(0, 0.05, len(x))
        low = truth - random.uniform(-0.2, 1, 3)
        high = low + random.uniform(0.1, 1.5, 3)
        start = (low + high) / 2
        expected = optimize.least_squares(
            lambda p: p[0] * np.exp(-p[1] * x) + p[2] - y, start, bounds=(low, high), xtol=1e-14, ftol=1e-14, gtol=1e-14
        )
        graph, values = mf.Graph(), mf.Values({name: mf.Point1(position=[s]) for name, s in zip(names, start)})
        graph.add_many(decay, [list(names)] * len(x), {"x": x, "y": y})
        for name, least, most in zip(names, low, high):
            graph.bound(name, "x", min=least, max=most)
        solution = mf.solve(graph, values)
        assert solution.converged
        assert solution.cost <= expected.cost * (1 + 1e-6)
        found = np.array([solution.values[name].position[0] for name in names])
        np.testing.assert_allclose(found, expected.x, atol=2e-3)
        for bound in solution.outcome.get("active_bounds", []):
            i = names.index(bound["key"])
            assert found[i] == bound["value"] == (low if bound["side"] == "min" else high)[i]
            assert bound["multiplier"] == pytest.approx(abs(expected.grad[i]), rel=1e-2, abs=1e-3)
        active += len(solution.outcome.get("active_bounds", []))
    assert active > 20


def test_bounds_are_part_of_a_graph() -> None:
    graph, values = mf.Graph(), mf.Values({"p": mf.Point2(position=[3, 4])})
    graph.add(["p"], mf.prior_point2(value=mf.Point2(position=[0, 0])))
    graph.bound("p", "x", min=1)
    graph.bound("p", "y", min=-1, max=5)
    expected = {"p": {"x": (1.0, np.inf), "y": (-1.0, 5.0)}}
    for same in (graph, copy.deepcopy(graph), pickle.loads(pickle.dumps(graph)), mf.Graph() + graph):
        assert dict(same.bounds) == expected
        np.testing.assert_allclose(mf.solve(same, values).values["p"].position, [1, 0], atol=1e-8)
    assert "bounds" in graph.to_document(values)
    graph.unbound("p")
    assert not graph.bounds


def test_a_sum_of_graphs_has_the_bounds_of_both() -> None:
    a, b = mf.Graph(), mf.Graph()
    a.bound("p", "x", min=0, max=3)
    b.bound("p", "x", min=-1, max=2)
    for both in (a + b, b + a):
        assert dict(both.bounds) == {"p": {"x": (0.0, 2.0)}}


def test_bounds_that_do_not_fit_are_errors() -> None:
    graph, values = mf.Graph(), mf.Values({"p": mf.Point2(position=[3, 4])})
    graph.add(["p"], mf.prior_point2(value=mf.Point2(position=[0, 0])))
    with pytest.raises(mf.ArgumentError, match="expected min ≤ max, got min = 2 and max = 1"):
        graph.bound("p", "x", min=2, max=1)
    with pytest.raises(mf.ArgumentError, match="expected a limit"):
        graph.bound("p", "x")
    graph.bound("p", "x", max=1)
    with pytest.raises(mf.GraphError, match="`p`: x = 3 is out of its bounds: 1 or less"):
        mf.solve(graph, values)
    graph.bound("p", "x", min=2)
    with pytest.raises(mf.GraphError, match="the bounds of x exclude each other: 2 or more, and 1 or less"):
        mf.solve(graph, values)
    with pytest.raises(mf.ManifactorError, match="`p` has bounds, and the smoother has none"):
        mf.Smoother().push(graph, values)


@mf.factor
def on_circle(p: mf.Point2, radius: Any) -> Any:
    return p[0] ** 2 + p[1] ** 2 - radius**2


@mf.batch(rows=1)
def apart(p: mf.Point2, q: mf.Point2, distance: Any) -> Any:
    return np.linalg.norm(q - p, axis=1) - distance


def test_a_batched_function_can_be_a_constraint() -> None:
    graph, values = mf.Graph(), mf.Values({i: mf.Point2(position=[1.3 * i, 0.2 * i]) for i in range(4)})
    for i in range(4):
        graph.add(mf.prior(i, mf.Point2(position=[1.2 * i, 0])))
    graph.add_many(apart, [[0, 1], [1, 2], [2, 3]], {"distance": np.ones(3)}, loss=mf.constraint())
    solution = mf.solve(graph, values)
    assert solution.converged
    at = np.array([solution.values[i].position for i in range(4)])
    np.testing.assert_allclose(np.linalg.norm(np.diff(at, axis=0), axis=1), 1, atol=1e-8)
    np.testing.assert_allclose(at, [[0.3, 0], [1.3, 0], [2.3, 0], [3.3, 0]], atol=1e-6)


def test_constraints_are_satisfied() -> None:
    graph, values = mf.Graph(), mf.Values({"p": mf.Point2(position=[1, 0.5])})
    graph.add(["p"], mf.prior_point2(value=mf.Point2(position=[3, 4])))
    graph.add(["p"], on_circle(radius=2.0), loss=mf.constraint())
    solution = mf.solve(graph, values)
    assert solution.converged
    np.testing.assert_allclose(solution.values["p"].position, [1.2, 1.6], atol=1e-9)
    [state] = solution.outcome["constraints"]
    # (p - (3, 4)) + 2 λ p = 0
    assert state["multipliers"][0] == pytest.approx((3 / 1.2 - 1) / 2, rel=1e-6)
    assert solution.cost == pytest.approx(4.5) == graph.cost(solution.values)
    again = pickle.loads(pickle.dumps(solution))
    np.testing.assert_allclose(again.covariances("p")["p"], solution.covariances("p")["p"], rtol=1e-3, atol=1e-6)
    with pytest.raises(mf.ManifactorError, match="factor 1 is a constraint, and the smoother has none"):
        mf.Smoother().push(graph, values)
