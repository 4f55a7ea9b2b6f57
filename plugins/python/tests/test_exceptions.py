"""Exceptions of functions under `@mf.batch`: the call that evaluates the function raises them, and no other one."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable
from typing import Any

import manifactor as mf
import numpy as np
import pytest

START = mf.Values({"x0": mf.Point1(position=[1.5])})


class Switch:
    """A factor x³ - m whose function raises an exception when it is told to."""

    def __init__(self) -> None:
        self.fails: Callable[[Any], bool] = lambda x: False

        @mf.batch(rows=1)
        def cube(x: mf.Point1, m: Any) -> Any:
            numbers = np.asarray(x)
            if self.fails(numbers):
                raise ConnectionError("no table")
            return numbers**3 - m[:, None]

        self.cube = cube

    def graph(self) -> mf.Graph:
        graph = prior(1.0)
        graph.add("x0", self.cube(m=8.0), sigma=1.0)
        return graph


def prior(position: float) -> mf.Graph:
    graph = mf.Graph()
    graph.add(mf.prior("x0", mf.Point1(position=[position]), sigma=10.0))
    return graph


def smoother_of(switch: Switch) -> mf.Smoother:
    smoother = mf.Smoother(relinearize_every=1, relinearization_threshold=0.0)
    smoother.push(switch.graph(), START)
    for _ in range(20):
        smoother.update()
    return smoother


def test_a_smoother_is_unchanged_after_an_exception_of_an_old_factor() -> None:
    switch = Switch()
    smoother = smoother_of(switch)
    before = (smoother["x0"], smoother.covariance("x0"), smoother.cost(), len(smoother.graph()))
    smoother.push(prior(3.0), mf.Values())
    switch.fails = lambda x: True
    for query in (smoother.update, smoother.cost, smoother.finish):
        with pytest.raises(ConnectionError, match="no table"):
            query()
    assert len(smoother.graph()) == before[3]
    switch.fails = lambda x: False
    assert (smoother["x0"], smoother.covariance("x0"), smoother.cost(), len(smoother.graph())) == before
    # the pushed factor waits for the next update
    for _ in range(20):
        smoother.update()
    batch = mf.solve(smoother.graph(), START)
    assert len(smoother.graph()) == 3
    np.testing.assert_allclose(smoother["x0"].position, batch.values["x0"].position, atol=1e-8)


def test_a_new_factor_whose_function_fails_is_not_added() -> None:
    old, new = Switch(), Switch()
    smoother = smoother_of(old)
    before = (smoother["x0"], smoother.covariance("x0"))
    graph = mf.Graph()
    graph.add("x0", new.cube(m=7.0), sigma=1.0)
    new.fails = lambda x: True
    smoother.push(graph, mf.Values())
    with pytest.raises(ConnectionError):
        smoother.update()
    assert (smoother["x0"], smoother.covariance("x0")) == before


def test_an_update_is_undone_if_only_a_new_factor_fails() -> None:
    switch = Switch()
    smoother = smoother_of(switch)
    before = (smoother["x0"], smoother.covariance("x0"), len(smoother.graph()))
    graph = prior(3.0)
    graph.add("x1", switch.cube(m=7.0), sigma=1.0)
    smoother.push(graph, mf.Values({"x1": mf.Point1(position=[50.0])}))
    switch.fails = lambda x: bool(np.any(x > 40))
    with pytest.raises(ConnectionError):
        smoother.update()
    assert (smoother["x0"], smoother.covariance("x0"), len(smoother.graph())) == before
    assert "x1" not in smoother


def test_a_function_that_fails_at_a_new_point_keeps_its_linearization() -> None:
    switch = Switch()
    smoother = smoother_of(switch)
    known = float(smoother["x0"].position[0])
    switch.fails = lambda x: bool(np.any(np.abs(x - known) > 1e-3))
    graph = mf.Graph()
    graph.add(mf.prior("x0", mf.Point1(position=[3.0]), sigma=0.1))
    smoother.push(graph, mf.Values())
    with pytest.raises(ConnectionError):
        smoother.update()
    switch.fails = lambda x: False
    # two priors, and the derivative 3x² of the factor at the old point
    np.testing.assert_allclose(smoother.covariance("x0"), 1 / (0.01 + 100 + (3 * known**2) ** 2), rtol=1e-6)
    assert len(smoother.graph()) == 3
    for _ in range(20):
        smoother.update()
    batch = mf.solve(smoother.graph(), START)
    np.testing.assert_allclose(smoother["x0"].position, batch.values["x0"].position, atol=1e-8)
    np.testing.assert_allclose(smoother.covariance("x0"), batch.covariances("x0")["x0"], rtol=1e-6)


@pytest.mark.parametrize(
    "query",
    [
        lambda graph, solution: solution.joint_covariance("x0"),
        lambda graph, solution: graph.cost(START),
        lambda graph, solution: graph[1].factor.residual(START["x0"]),
        lambda graph, solution: mf.check_factor(graph[1].factor),
    ],
)
def test_a_query_raises_the_exception_and_leaves_none(query: Any) -> None:
    switch = Switch()
    graph = switch.graph()
    solution = mf.solve(graph, START)
    switch.fails = lambda x: True
    try:
        query(graph, solution)
    except ConnectionError:
        pass
    else:
        pytest.fail("the exception is lost")
    assert mf.solve(prior(1.0), START).converged


def test_no_query_leaves_an_exception_for_the_next_call() -> None:
    switch = Switch()
    graph, smoother = switch.graph(), smoother_of(switch)
    solution = mf.solve(graph, START)
    switch.fails = lambda x: True
    queries: list[Callable[[], Any]] = [
        lambda: solution.covariances(),
        lambda: solution.diagnosis(),
        lambda: graph.check(START),
        lambda: smoother.covariance("x0"),
        lambda: smoother.rejections(),
        lambda: smoother.push(switch.graph(), mf.Values()),
        lambda: repr(graph[1]),
    ]
    for query in queries:
        try:
            query()
        except ConnectionError:
            pass
        assert mf.solve(prior(1.0), START).converged


def test_an_exception_belongs_to_its_thread() -> None:
    switch = Switch()
    switch.fails = lambda x: True
    bad, fine = mf.Graph(), prior(1.0)
    bad.add("x0", switch.cube(m=8.0))
    # work without the interpreter's lock, after the exception
    bad.add_many(mf.prior_point1, [["x0"]] * 20_000, {"value": {"position": np.zeros((20_000, 1))}})
    counts: dict[str, Counter[str]] = {"bad": Counter(), "fine": Counter()}

    def work(name: str, call: Callable[[], Any]) -> None:
        for _ in range(300):
            try:
                call()
                counts[name]["returned"] += 1
            except ConnectionError:
                counts[name]["raised"] += 1

    threads = [
        threading.Thread(target=work, args=("bad", lambda: bad.cost(START))),
        threading.Thread(target=work, args=("fine", lambda: mf.solve(fine, START))),
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert counts == {"bad": {"raised": 300}, "fine": {"returned": 300}}


def test_an_exception_within_an_observer_belongs_to_its_call() -> None:
    switch = Switch()
    bad = switch.graph()
    switch.fails = lambda x: True
    seen = []

    def observer(_: dict[str, Any]) -> None:
        with pytest.raises(ConnectionError):
            bad.cost(START)
        seen.append(True)

    assert mf.solve(prior(1.0), START, observer=observer).converged and seen
