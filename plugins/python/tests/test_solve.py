"""Solving: reports, the end of a solve, and graphs that grow."""

from __future__ import annotations

import _thread
import threading
import time
from typing import Any

import manifactor as mf
import numpy as np
import pytest


def chain(n: int = 20) -> tuple[mf.Graph, mf.Values]:
    graph, values = mf.Graph(), mf.Values()
    values.insert_many(np.arange(n), mf.Point2, {"position": np.zeros((n, 2))})
    graph.add("x0", mf.prior_point2(value=mf.Point2(position=[0, 0])))
    keys = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
    graph.add_many(mf.between_point2, keys, {"relative": {"position": (1.0, 0.5)}})
    return graph, values


def test_covariances_of_a_chain_add_up() -> None:
    graph, values = chain()
    solution = mf.solve(graph, values)
    covariances = solution.covariances()
    for i in range(20):
        np.testing.assert_allclose(covariances[f"x{i}"], (i + 1) * np.eye(2), atol=1e-9)
    assert list(solution.covariances(["x3"])) == ["x3"] == list(solution.covariances("x3"))
    joint = solution.joint_covariance(["x1", "x3"])
    np.testing.assert_allclose(joint, np.kron([[2, 2], [2, 4]], np.eye(2)), atol=1e-9)
    with pytest.raises(mf.SolveError, match="there is no variable `y`"):
        solution.covariances(["y"])


def test_what_nothing_constrains_is_told() -> None:
    graph, values = chain()
    values["y"] = mf.Point2(position=[0, 0])
    solution = mf.solve(graph, values)
    assert not solution.converged and "y" in solution.termination
    assert solution.outcome["termination"]["status"] == "indeterminate"
    free = mf.Graph()
    free.add(["x0", "x1"], mf.between_point2(relative=mf.Point2(position=[1, 0])))
    loose = mf.solve(free, mf.Values({"x0": values["x0"], "x1": values["x1"]}))
    assert "undetermined" in loose.diagnosis()
    with pytest.raises(mf.SolveError, match="the covariance is infinite"):
        loose.covariances()


def test_costs_weights_and_residuals() -> None:
    graph = mf.Graph()
    for at in (0.0, 0.0, 0.0, 10.0):
        graph.add("x", mf.prior_point1(value=mf.Point1(position=[at])), loss=mf.cauchy())
    solution = mf.solve(graph, mf.Values({"x": mf.Point1(position=[0.5])}))
    assert solution.costs.shape == solution.weights.shape == (4,)
    assert solution.cost == pytest.approx(solution.costs.sum()) and solution.weights[3] < 0.1 < solution.weights[0]
    assert solution.residual(3) == pytest.approx(solution.values["x"].position - 10)
    rho, weight = mf.cauchy().rho(solution.residual(3) ** 2)
    assert solution.costs[3] == pytest.approx(0.5 * rho[0]) and weight[0] == pytest.approx(solution.weights[3])


def test_solvers_and_starts_by_name() -> None:
    graph, values = chain()
    for solver in (mf.auto(), mf.dogleg(), mf.gauss_newton(stop={"max_iterations": 5}), mf.levenberg_marquardt()):
        assert mf.solve(graph, values, solver).cost < 1e-20
    assert mf.solve(graph, values, mf.auto(), start=mf.starts.spanning_tree()).cost < 1e-20
    with pytest.raises(TypeError, match="solver: expected a solver, got Factor"):
        mf.solve(graph, values, mf.prior_point1(value=mf.Point1(position=[0])))  # type: ignore[arg-type]


def test_an_observer_sees_each_step_and_may_end_the_solve() -> None:
    graph, values = chain()
    seen: list[dict[str, Any]] = []
    mf.solve(graph, values, mf.levenberg_marquardt(), observer=seen.append)
    assert seen and seen[0]["iteration"] == 1 and seen[0]["trial_cost"] < seen[0]["cost"]
    ended = mf.solve(graph, values, mf.levenberg_marquardt(), observer=lambda _: False)
    assert ended.termination == "interrupted"

    def fails(_: dict[str, Any]) -> None:
        raise LookupError("of the observer")

    with pytest.raises(LookupError, match="of the observer"):
        mf.solve(graph, values, mf.levenberg_marquardt(), observer=fails)


def slow() -> tuple[mf.Graph, mf.Values]:
    """A graph whose solve takes seconds."""
    n = 4000
    rng = np.random.default_rng(0)
    graph, values = mf.Graph(), mf.Values()
    values.insert_many(np.arange(n), mf.Point2, {"position": rng.normal(size=(n, 2))})
    keys = rng.integers(0, n, size=(6 * n, 2))
    keys = keys[keys[:, 0] != keys[:, 1]]
    unit = "norm(b - a) - 1"
    factor = mf.expression(variables={"a": "point2", "b": "point2"}, residual=[unit])
    graph.add_many(factor, keys)
    graph.add("x0", mf.prior_point2(value=mf.Point2(position=[0, 0])))
    return graph, values


def test_ctrl_c_ends_a_solve_and_other_threads_run_meanwhile() -> None:
    graph, values = slow()
    ticks = 0

    def tick() -> None:
        nonlocal ticks
        for _ in range(20):
            time.sleep(0.01)
            ticks += 1
        _thread.interrupt_main()

    threading.Thread(target=tick).start()
    stop = mf.types.Stopping(max_iterations=10_000, relative_cost=0.0, absolute_cost=0.0, gradient=0.0, step=0.0)
    with pytest.raises(KeyboardInterrupt):
        mf.solve(graph, values, mf.gauss_newton(stop=stop))
        time.sleep(5)
    assert ticks == 20


def test_a_session_follows() -> None:
    session = mf.Smoother(relinearize_every=1)
    graph, values = mf.Graph(), mf.Values({"x0": mf.Point2(position=[0, 0])})
    graph.fix("x0")
    session.push(graph, values)
    session.update()
    ids = []
    for i in range(1, 10):
        graph, values = mf.Graph(), mf.Values({f"x{i}": mf.Point2(position=[0, 0])})
        graph.add([f"x{i - 1}", f"x{i}"], mf.between_point2(relative=mf.Point2(position=[1, 2])), noise=0.5)
        ids += session.push(graph, values)
        report = session.update()
    assert report["parked"] == [] and len(session) == 10 and "x9" in session
    np.testing.assert_allclose(session["x9"].position, [9, 18], atol=1e-9)
    np.testing.assert_allclose(session.covariance(["x9"]), 9 * 0.25 * np.eye(2), atol=1e-9)
    assert session.values.types() == {"point2": 10} and session.cost() < 1e-12
    session.remove(ids[-1:])
    assert session.update()["parked"] == ["x9"]
    values, outcome = session.finish()
    assert outcome["termination"]["status"] == "converged" and len(values) == 10
    again = mf.Smoother.load(session.save())
    assert again["x8"] == session["x8"] and repr(again) == repr(session)


def test_a_session_says_what_is_wrong() -> None:
    with pytest.raises(mf.ArgumentError, match="unknown field `wildfire`.*did you mean `wildfire_threshold`"):
        mf.Smoother(wildfire=0.1)
    with pytest.raises(mf.ArgumentError, match="relinearization_threshold"):
        mf.Smoother(relinearization_threshold=-1.0)
    session = mf.Smoother()
    session.push(mf.Graph(), mf.Values({"x": mf.Point1(position=[0])}))
    with pytest.raises(mf.GraphError, match="there is a variable `x` already"):
        session.push(mf.Graph(), mf.Values({"x": mf.Point1(position=[0])}))
    with pytest.raises(KeyError):
        session["y"]
