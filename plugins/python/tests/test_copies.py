"""Copies are independent, and `pickle` preserves every bit."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import manifactor as mf
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

POSE = mf.Se2(translation=[1, 2], angle=0.3)


def chain() -> tuple[mf.Graph, mf.Values]:
    graph, values = mf.Graph(), mf.Values()
    for i in range(4):
        values[f"x{i}"] = mf.Se2(translation=[1.1 * i, 0.1], angle=0.01 * i)
    step = mf.between_se2(relative=mf.Se2(translation=[1, 0], angle=0.1))
    for i in range(3):
        graph.add([f"x{i}", f"x{i + 1}"], step, noise=0.1 * (i + 1), loss=mf.huber(), name="step")
    graph.fix("x0")
    graph.fix("x3", ["x"])
    return graph, values


CAMERA: Any = {"fx": 525.0, "fy": 525.0, "cx": 320.0, "cy": 240.0, "width": 640, "height": 480}
THINGS: list[Any] = [
    POSE,
    mf.Se3(translation=[0.1, 0.2, 0.3], rotation=[0.5, 0.5, 0.5, 0.5]),
    mf.Point1(position=[1 / 3]),
    mf.DualQuadric(translation=[0, 0, 1], rotation=[0, 0, 0, 1], semi_axes=[0.1, 0.2, 0.3]),
    mf.prior_se2(value=POSE),
    mf.between_se2(relative=POSE),
    mf.bounding_box(box=[0, 0, 10, 10], camera=CAMERA),
    mf.expression(variables={"q": "dual_quadric"}, residual=["1 - abs(dot(major_axis(q), up))"]),
    mf.huber(scale=1.5),
    mf.levenberg_marquardt(),
    mf.gnc(),
    mf.Noise(),
    mf.Noise(sigma=0.1),
    mf.Noise(sigmas=[1 / 3, 0.2], observed=[True, False]),
    mf.Noise(covariance=[[1, 0.5], [0.5, 2]]),
    *chain(),
    mf.Graph(),
    mf.Values(),
]


@pytest.mark.parametrize("thing", THINGS, ids=lambda thing: repr(thing)[:24])
def test_all_kinds_go_through_pickle_and_copies(thing: Any) -> None:
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        again = pickle.loads(pickle.dumps(thing, protocol))
        assert type(again) is type(thing) and repr(again) == repr(thing)
    for again in (copy.copy(thing), copy.deepcopy(thing), copy.deepcopy({"a": [thing]})["a"][0]):
        assert type(again) is type(thing) and repr(again) == repr(thing)
    if not isinstance(thing, mf.Graph | mf.Values):
        assert pickle.loads(pickle.dumps(thing)) == thing and copy.deepcopy(thing) == thing


@given(st.lists(st.floats(-1e6, 1e6), min_size=7, max_size=7))
def test_a_pose_comes_back_to_the_last_bit(numbers: list[float]) -> None:
    if np.linalg.norm(numbers[3:]) < 1e-3:
        return
    pose = mf.Se3(translation=numbers[:3], rotation=np.array(numbers[3:]) / np.linalg.norm(numbers[3:]))
    again = pickle.loads(pickle.dumps(pose))
    assert again == pose and again.rotation.tobytes() == pose.rotation.tobytes()


def test_a_problem_that_was_pickled_has_the_same_solution() -> None:
    graph, values = chain()
    again = mf.solve(pickle.loads(pickle.dumps(graph)), pickle.loads(pickle.dumps(values)))
    assert again.cost == mf.solve(graph, values).cost
    restored = pickle.loads(pickle.dumps(graph))
    assert restored.fixed == graph.fixed and [restored[i] for i in range(3)] == [graph[i] for i in range(3)]


def test_a_session_goes_through_pickle() -> None:
    session = mf.Smoother()
    session.push(*chain())
    session.update()
    again = pickle.loads(pickle.dumps(session))
    assert again["x2"] == session["x2"] and copy.deepcopy(session).cost() == session.cost()


def test_a_solution_goes_through_pickle_and_copies() -> None:
    solution = mf.solve(*chain())
    for again in (pickle.loads(pickle.dumps(solution)), copy.copy(solution), copy.deepcopy(solution)):
        assert repr(again) == repr(solution) and again.converged and again.outcome == solution.outcome
        assert again.cost == solution.cost and np.array_equal(again.costs, solution.costs)
        assert again.values["x2"] == solution.values["x2"] and len(again.graph) == 3
        assert np.allclose(again.covariances("x2")["x2"], solution.covariances("x2")["x2"], rtol=1e-9)
        assert np.array_equal(again.residual(1), solution.residual(1))


def test_a_function_of_python_is_refused_by_pickle() -> None:
    @mf.batch(rows=1)
    def norm(a: mf.Point2) -> Any:
        return np.linalg.norm(a, axis=1)

    with pytest.raises(mf.ArgumentError, match="function of Python"):
        pickle.dumps(norm())
    assert copy.copy(norm()).type == "python"


def test_a_changed_copy_leaves_the_original_alone() -> None:
    graph, values = chain()
    for other, changed in ((copy.copy(graph), copy.copy(values)), (copy.deepcopy(graph), mf.Values(values))):
        other.add("x1", mf.prior_se2(value=POSE))
        changed["x1"] = POSE
        assert (len(graph), len(other)) == (3, 4) and values["x1"] != POSE
