"""Factors with their keys: `FactorEntry`, `between`, `prior`, and the cost of a graph."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import manifactor as mf
import numpy as np
import pytest

STEP = mf.Se2(translation=[1, 0.5], angle=0.3)
VALUES = [
    mf.So2(angle=0.4),
    mf.So3(rotation=[0, 0, 0.6, 0.8]),
    STEP,
    mf.Se3(translation=[1, 2, 3], rotation=[0.6, 0, 0, 0.8]),
    mf.Sim3(translation=[1, 2, 3], rotation=[0.6, 0, 0, 0.8], scale=1.1),
    mf.Point1(position=[2]),
    mf.Point2(position=[1, 2]),
    mf.Point3(position=[1, 2, 3]),
]


@pytest.mark.parametrize("value", VALUES, ids=lambda value: value.type)
def test_between_and_prior_are_the_factors_of_the_type(value: mf.Variable) -> None:
    graph = mf.Graph()
    assert graph.add(mf.between("a", "b", value, sigma=0.1)) == 0
    assert graph.add(mf.prior("a", value, loss=mf.huber(), name="first")) == 1
    between, prior = getattr(mf, f"between_{value.type}"), getattr(mf, f"prior_{value.type}")
    assert graph[0] == mf.FactorEntry(["a", "b"], between(relative=value), noise=0.1)
    assert graph[1] == mf.FactorEntry("a", prior(value=value), loss=mf.huber(), name="first")


def test_the_parts_of_a_factor() -> None:
    entry = mf.between(0, ("l", 3), STEP, sigmas=[0.1, 0.2, 0.3], loss=mf.cauchy(), name="step")
    assert entry.keys == ["x0", "l3"] and entry.name == "step"
    assert entry.factor == mf.between_se2(relative=STEP)
    assert entry.noise == mf.Noise(sigmas=[0.1, 0.2, 0.3]) and entry.loss == mf.cauchy()
    assert sorted(entry.to_dict()) == ["factor", "keys", "loss", "name", "noise"]
    plain = mf.prior("a", STEP)
    assert plain.loss is None and plain.noise == mf.Noise() and plain.name == "prior_se2"
    for again in (copy.copy(entry), copy.deepcopy(entry), pickle.loads(pickle.dumps(entry))):
        assert again == entry and hash(again) == hash(entry) and again != plain


def test_a_repr_can_be_pasted() -> None:
    names = {**vars(mf), **vars(mf.losses)}
    for entry in (mf.prior("a", STEP), mf.between(0, 1, STEP, sigma=0.1, loss=mf.huber(scale=2.0), name="it's")):
        assert eval(repr(entry), names) == entry  # noqa: S307


def test_a_graph_is_a_sequence_of_factors() -> None:
    graph = mf.Graph()
    for i in range(3):
        graph.add(mf.between(i, i + 1, STEP))
    assert [entry.keys for entry in graph] == [["x0", "x1"], ["x1", "x2"], ["x2", "x3"]]
    other = mf.Graph()
    for entry in graph:
        other.add(entry)
    assert [other[-i] for i in (1, 2, 3)] == [graph[2], graph[1], graph[0]]
    with pytest.raises(IndexError, match="there is no factor -4: the graph has 3"):
        graph[-4]


@pytest.mark.parametrize(
    ("made", "error", "message"),
    [
        (lambda: mf.between("a", "a", STEP), mf.GraphError, "names the variable `a` twice"),
        (lambda: mf.between("a", "", STEP), mf.ArgumentError, "a key needs at least one character"),
        (lambda: mf.between("a", 1.5, STEP), mf.ArgumentError, "expected a text, a whole number"),  # type: ignore[arg-type]
        (lambda: mf.between("a", True, STEP), mf.ArgumentError, "expected a text, a whole number"),
        (lambda: mf.between("a", "b", [1, 2, 3]), TypeError, "relative: expected a value such as Se3"),  # type: ignore[arg-type]
        (lambda: mf.between("a", "b", mf.Se2), TypeError, r"call it: Se2\(…\)"),  # type: ignore[arg-type]
        (lambda: mf.between("a", "b", STEP, sigma=0.1, sigmas=[1] * 3), mf.ArgumentError, "expected one of noise, sigma and sigmas"),
        (lambda: mf.between("a", "b", STEP, noise=0.1, sigma=0.1), mf.ArgumentError, "expected one of noise, sigma and sigmas"),
        (lambda: mf.between("a", "b", STEP, sigma=0), mf.ArgumentError, "a standard deviation must be"),
        (lambda: mf.between("a", "b", STEP, sigma=float("nan")), mf.ArgumentError, "expected finite numbers, got NaN"),
        (lambda: mf.between("a", "b", STEP, sigma=[0.1]), mf.ArgumentError, "expected an array of shape"),  # type: ignore[arg-type]
        (lambda: mf.between("a", "b", STEP, sigmas=0.1), mf.ArgumentError, "expected an array of shape"),
        (lambda: mf.between("a", "b", STEP, sigmas=[0.1, 0.1]), mf.GraphError, "the noise has 2 rows, the residual 3"),
        (lambda: mf.between("a", "b", STEP, sigmas=["a"] * 3), mf.ArgumentError, "sigmas: expected an array of real numbers"),
        (lambda: mf.between("a", "b", STEP, loss=0.1), TypeError, "loss: expected a loss, got float"),  # type: ignore[arg-type]
        (lambda: mf.between("a", "b", STEP, loss=mf.huber), TypeError, r"call it: huber\(…\)"),  # type: ignore[arg-type]
        (lambda: mf.prior("a", STEP, sigmas=np.ones((3, 3))), mf.ArgumentError, "expected an array of shape"),
        (lambda: mf.between("a", "b", mf.Velocity(linear=[0, 0, 0])), mf.ArgumentError, "unknown factor `between_velocity`"),
        (lambda: mf.Graph().add("a"), mf.ArgumentError, "expected a FactorEntry"),
        (lambda: mf.Graph().add(mf.prior("a", STEP), sigma=1), mf.ArgumentError, "pass it alone"),
        (lambda: mf.Graph().add(mf.prior("a", STEP), mf.prior_se2(value=STEP)), mf.ArgumentError, "pass it alone"),
        (lambda: mf.FactorEntry("a", mf.between_se2(relative=STEP)), mf.GraphError, "connects 2 variables, got 1 keys"),
    ],
)
def test_a_wrong_factor_is_refused(made: Callable[[], Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        made()


def test_a_field_that_is_wrong_has_its_place() -> None:
    # such fields are read twice, without places and with them
    with pytest.raises(mf.ArgumentError) as wrong:
        mf.between_se2(relative={"translation": [0, float("nan")], "angle": 0})
    assert wrong.value.mistakes[0].place == "relative.translation[1]"
    with pytest.raises(mf.ArgumentError) as unknown:
        mf.Factor("between_se2", {"relative": {"translation": [0, 0], "angel": 0}})
    assert unknown.value.mistakes[0].place == "relative.angel"
    with pytest.raises(mf.ArgumentError, match="finite"):
        mf.Se2(translation=np.array([0, np.inf]), angle=0)


def test_the_cost_of_a_graph() -> None:
    graph, values = mf.Graph(), mf.Values({"a": mf.Point2(position=[3, 4])})
    zero = mf.Point2(position=[0, 0])
    graph.add(mf.prior("a", zero, sigma=0.5))
    assert graph.cost(values) == 50.0
    graph.add(mf.prior("a", zero, loss=mf.huber(scale=1.0)))
    assert graph.cost(values) == pytest.approx(50 + 4.5)
    # not defined at the point itself
    graph.add(["a", "b"], mf.range_point2_point2(range=1.0) if hasattr(mf, "range_point2_point2") else mf.between_point2(relative=zero))
    with pytest.raises(mf.GraphError, match="there is no variable `b`"):
        graph.cost(values)
    values["b"] = mf.Point2(position=[3, 4])
    graph.fix("a")
    graph.fix("b")
    assert graph.cost(values) == pytest.approx(54.5)


def test_the_cost_is_that_of_a_solve() -> None:
    random = np.random.default_rng(0)
    graph, values = mf.Graph(), mf.Values({0: mf.Se3.identity()})
    for i in range(20):
        step = mf.Se3.exp(random.normal(size=6))
        values[i + 1] = values[i] * step
        graph.add(mf.between(i, i + 1, step * mf.Se3.exp(0.1 * random.normal(size=6)), sigma=0.1, loss=mf.cauchy()))
    solution = mf.solve(graph, values)
    assert graph.cost(values) == pytest.approx(solution.initial_cost, rel=1e-12)
    assert graph.cost(solution.values) == pytest.approx(solution.cost, rel=1e-9, abs=1e-15)


def test_a_camera_looks_at_a_point() -> None:
    pose = mf.Se3.look_at([3, -2, 5], [1, 1, 1])
    seen = pose.inverse() @ np.array([1.0, 1, 1])
    np.testing.assert_allclose(seen, [0, 0, 29**0.5], atol=1e-12)
    # what is above is at smaller y
    assert (pose.inverse() @ np.array([1.0, 1, 2]))[1] < 0
    np.testing.assert_allclose(mf.Se3.look_at([0, 0, 0], [0, 0, 2], up=[0, -1, 0]).matrix(), np.eye(4), atol=1e-15)
    for target in ([3, -2, 5], [3, -2, 9]):
        with pytest.raises(mf.ArgumentError, match="a target that differs"):
            mf.Se3.look_at([3, -2, 5], target)


@mf.factor
def flat(x: mf.Se3, p: mf.Point3, turn: Any = (0.0, 0.0)) -> Any:
    seen = x.inverse() * p
    rotation = np.array([[0.8, -0.6, 0.1], [0.6, 0.8, -0.2]])
    return [rotation @ seen, seen[:2] @ np.array([[1.0, 2.0], [3.0, 4.0]]) - turn, seen[::2].sum(), np.tanh(seen[2]), seen[1:2]]


def test_a_trace_knows_slices_matrices_sums_and_tanh() -> None:
    x, point = mf.Se3.exp([0.1, -0.2, 0.3, 1, 2, 3]), mf.Point3(position=[0.3, 0.2, 2.5])
    seen = x.inverse() @ np.array(point.position)
    rotation = np.array([[0.8, -0.6, 0.1], [0.6, 0.8, -0.2]])
    expected = np.array([*(rotation @ seen), *(seen[:2] @ np.array([[1, 2], [3, 4]])), seen[0] + seen[2], np.tanh(seen[2]), seen[1]])
    np.testing.assert_allclose(flat().residual(x, point), expected, rtol=1e-12)
    assert mf.check_factor(flat)
    for far in (-400.0, -1e-9, 0.0, 1e-9, 400.0):
        there = mf.Point3(position=x @ np.array([0.1, 0.2, far]))
        assert flat().residual(x, there)[5] == pytest.approx(np.tanh(far), abs=1e-9)


def test_a_trace_refuses_what_formulas_lack() -> None:
    for wrong in (lambda p: p[3:], lambda p: np.ones((4, 3)) @ p, lambda p: np.ones((2, 2)) @ p, lambda p: np.ones((0, 3)) @ p):
        with pytest.raises(mf.TraceError):
            mf.factor(_of_point(wrong))()


def _of_point(function: Callable[[Any], Any]) -> Callable[..., Any]:
    def residual(p: mf.Point3) -> Any:
        return function(p)

    return residual


def test_a_pose_graph_is_saved_as_g2o(tmp_path: Path) -> None:
    graph, values = mf.Graph(), mf.Values({i: mf.Se2(translation=[1.1 * i, 0], angle=0.1) for i in range(3)})
    for i in range(2):
        graph.add(mf.between(i, i + 1, STEP, sigmas=[0.1, 0.1, 0.02]))
    graph.fix(0)
    mf.save(tmp_path / "graph.g2o", graph, values)
    read, start = mf.load(tmp_path / "graph.g2o")
    assert mf.solve(read, start).cost == pytest.approx(mf.solve(graph, values).cost, abs=1e-9)
    assert read.cost(start) == pytest.approx(graph.cost(values), rel=1e-9)
    # g2o has no losses
    graph.add(mf.between(0, 2, STEP, loss=mf.huber()))
    with pytest.warns(UserWarning, match="loss"):
        mf.save(tmp_path / "graph.g2o", graph, values, force=True)
    with pytest.raises(mf.ArgumentError, match="expected one of the extensions .toml, .json, .yaml, .*.g2o"):
        mf.save(tmp_path / "graph.txt", graph, values)
    del values[2]
    with pytest.raises(mf.GraphError, match="there is no variable `x2`"):
        mf.save(tmp_path / "other.g2o", graph, values)
    assert not (tmp_path / "other.g2o").exists()


def test_columns_of_pandas_and_values_that_all_factors_share() -> None:
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame({"k": [0, 1, 2], "z": [10.0, 20.0, 30.0]})
    graph, values = mf.Graph(), mf.Values()
    graph.add_many(mf.range_se2_point2, [["a", "b"]] * 3, {"range": table["z"]})
    assert [graph[i].factor.range for i in range(3)] == [10, 20, 30]
    with pytest.raises(mf.ArgumentError, match="expected an array of 3 rows, one for each, got 2 rows"):
        graph.add_many(mf.range_se2_point2, [["a", "b"]] * 3, {"range": table["z"][:2]})
    values.insert_many(table["k"], mf.Point1, {"position": table[["z"]]})
    assert values["x2"] == mf.Point1(position=[30])
    step = mf.Se3.exp([0, 0, 0.1, 1, 0, 0])
    graph.add_many(mf.between_se3, [[0, 1], [1, 2]], {"relative": step})
    graph.add_many(mf.prior_se3, [0], {"value": step}, noise=np.float64(0.1))
    assert graph[4].factor == mf.between_se3(relative=step) and graph[5].factor == mf.prior_se3(value=step)
    # a number of NumPy is shared by all
    graph.add_many(mf.range_se2_point2, [["a", "b"]] * 2, {"range": np.float32(2)})
    assert graph[7].factor.range == 2
    sigmas: list[Any] = [np.float32(0.5), np.int64(2)]
    for sigma in sigmas:
        graph.add("x0", mf.prior_se3(value=step), noise=sigma)
    assert graph[8].noise == mf.Noise(0.5) and graph[9].noise == mf.Noise(2.0)


def test_masked_entries_are_refused() -> None:
    masked = np.ma.masked_greater(np.array([1.0, 2.0]), 1.5)
    with pytest.raises(mf.ArgumentError, match="range: expected an array without masked entries"):
        mf.Graph().add_many(mf.range_se2_point2, [["a", "b"]] * 2, {"range": masked})
    with pytest.raises(mf.ArgumentError, match="position: expected an array without masked entries"):
        mf.Point2(position=masked)
    with pytest.raises(mf.ArgumentError, match="without masked entries"):
        mf.Noise(sigmas=masked)
    assert mf.Point2(position=np.ma.masked_greater([1.0, 2.0], 5)) == mf.Point2(position=[1, 2])


def test_a_plain_condition_is_a_truth_value() -> None:
    big = 3

    def of(condition: Any) -> Any:
        @mf.factor
        def branch(a: mf.Point1) -> Any:
            return mf.where(condition, a, 2 * a)

        return branch().residual(mf.Point1(position=[2.0]))[0]

    assert of(big > 2) == 2 and of(np.bool_(big < 2)) == 4
    with pytest.raises(TypeError, match="expected a condition such as x < 1, got int"):
        of(-2)
