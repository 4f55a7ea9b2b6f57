"""A solution owns its graph and values, and a change that would be lost is an error."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import manifactor as mf
import numpy as np
import pytest

ZERO = mf.Se2(translation=[0, 0], angle=0)


def pair() -> tuple[mf.Graph, mf.Values]:
    graph, values = mf.Graph(), mf.Values({"a": ZERO, "b": mf.Se2(translation=[1.1, 0], angle=0)})
    graph.add(["a", "b"], mf.between_se2(relative=mf.Se2(translation=[1, 0], angle=0)), noise=0.1)
    graph.add("a", mf.prior_se2(value=ZERO), noise=0.1)
    return graph, values


def test_a_solution_answers_for_the_graph_that_was_solved() -> None:
    graph, values = pair()
    solution = mf.solve(graph, values)
    joint = solution.joint_covariance(["a", "b"])
    marginal, diagnosis = solution.covariances()["b"], solution.diagnosis()
    graph.add("b", mf.prior_se2(value=ZERO), noise=1e-6)
    graph.fix("a")
    assert np.array_equal(solution.covariances()["b"], marginal)
    assert np.array_equal(solution.joint_covariance(["a", "b"]), joint)
    assert solution.diagnosis() == diagnosis
    assert len(solution.graph) == len(solution.costs) == 2 and solution.graph.fixed == {}


def test_values_of_the_program_may_change_after_a_solve() -> None:
    graph, values = pair()
    solution = mf.solve(graph, values)
    estimate = solution.values["b"]
    del values["a"]
    values["b"] = ZERO
    assert solution.values["b"] == estimate and len(solution.values) == 2


def test_a_change_of_a_solution_is_an_error_and_of_a_copy_is_none() -> None:
    solution = mf.solve(*pair())
    estimate = solution.values["b"]
    with pytest.raises(mf.GraphError, match=r"copy\.copy\(values\)"):
        solution.values["b"] = ZERO
    with pytest.raises(mf.GraphError, match="values of a solution do not change"):
        del solution.values["b"]
    with pytest.raises(mf.GraphError, match="values of a solution"):
        solution.values.insert_many(["c"], mf.Point1, {"position": np.ones((1, 1))})
    with pytest.raises(mf.GraphError, match="graph of a solution"):
        solution.graph.add("b", mf.prior_se2(value=ZERO))
    with pytest.raises(mf.GraphError, match="graph of a solution"):
        solution.graph.fix("b")
    changed = copy.copy(solution.values)
    changed["b"] = ZERO
    assert changed["b"] == ZERO and solution.values["b"] == estimate
    # the estimate as initial values of the next solve
    assert mf.solve(solution.graph, solution.values).converged


def test_values_of_a_session_do_not_change() -> None:
    session = mf.Smoother()
    session.push(*pair())
    session.update()
    with pytest.raises(mf.GraphError, match="values of a smoother"):
        session.values["b"] = ZERO


QUADRIC = mf.DualQuadric(translation=[0, 0, 1], rotation=[0, 0, 0, 1], semi_axes=[0.1, 0.2, 0.3])


@pytest.mark.parametrize(
    "array",
    [
        mf.Values({"a": mf.Point3(position=[1, 2, 3])})["a"].position,
        QUADRIC.translation,
        QUADRIC.semi_axes,
        mf.between_se2(relative=ZERO).relative["translation"],
        mf.solve(*pair()).costs,
        mf.solve(*pair()).weights,
    ],
)
def test_an_array_of_an_attribute_is_for_reading(array: Any) -> None:
    before = array.copy()
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 5
    with pytest.raises(ValueError, match="read-only"):
        array += 1
    assert np.array_equal(array, before)


def test_fields_within_fields_are_for_reading() -> None:
    factor = mf.between_se2(relative=ZERO)
    with pytest.raises(TypeError):
        factor.relative["angle"] = 5
    again = mf.Factor("between_se2", {"relative": factor.relative})
    assert again == factor
    expression = mf.expression(variables={"q": "dual_quadric"}, residual=["1 - abs(dot(major_axis(q), up))"])
    with pytest.raises(TypeError):
        expression.residual[0] = "0"  # type: ignore[index]
    graph, _ = pair()
    graph.fix("a", ["x"])
    with pytest.raises(TypeError):
        graph.fixed["a"] = True  # type: ignore[index]
    assert graph.fixed == {"a": ["x"]}
    # the method returns a copy
    own = factor.to_dict()
    own["relative"]["angle"] = 5


def test_a_key_twice_in_one_call_is_an_error_that_names_its_rows() -> None:
    values = mf.Values({"l0": mf.Point1(position=[7])})
    rows = {"position": np.arange(4.0)[:, None]}
    for keys, prefix in ((np.array([0, 1, 2, 1]), "l"), (["l0", "l1", "l2", "l1"], None)):
        with pytest.raises(mf.ArgumentError, match="`l1` is in rows 1 and 3"):
            values.insert_many(keys, mf.Point1, rows, prefix=prefix)
    assert len(values) == 1 and values["l0"] == mf.Point1(position=[7])
    values.insert_many(np.arange(4), mf.Point1, rows, prefix="l")
    assert values["l0"] == mf.Point1(position=[0])


def test_poses_of_no_values_are_empty() -> None:
    values = mf.Values({"p": mf.Point3(position=[0, 0, 0])})
    assert mf.poses(values)[1].shape == (0, 4, 4) and mf.poses(values, mf.Se2)[1].shape == (0, 3, 3)
    assert mf.poses(values, mf.DualQuadric)[1].shape == (0, 4, 4)
    for of in (mf.Point3, "so3", mf.Plane):
        with pytest.raises(mf.ArgumentError, match="expected a type of poses.*se2, se3"):
            mf.poses(values, of)
    with pytest.raises(mf.ArgumentError, match="unknown variable `se4`"):
        mf.poses(values, "se4")


def test_a_file_is_replaced_only_if_asked_for(tmp_path: Path) -> None:
    graph, values = pair()
    file = tmp_path / "pair.toml"
    file.write_text("something else")
    with pytest.raises(mf.ExistsError, match=r"pair\.toml: the file exists already.*force=True"):
        mf.save(file, graph, values)
    with pytest.raises(FileExistsError):
        mf.save(str(file), graph, values)
    assert file.read_text() == "something else"
    mf.save(file, graph, values, force=True)
    assert len(mf.load(file)[0]) == 2


def test_a_file_that_load_would_refuse_is_not_written(tmp_path: Path) -> None:
    graph, values = pair()
    for spoil in ("missing", "type"):
        bad, of = copy.copy(graph), copy.copy(values)
        if spoil == "missing":
            del of["b"]
        else:
            of["b"] = mf.Point2(position=[0, 0])
        with pytest.raises(mf.GraphError, match="`b`"):
            mf.save(tmp_path / f"{spoil}.json", bad, of)
        assert list(tmp_path.iterdir()) == []
    for key in (" ", "a b", "ä\n", '"', "x.y", "\u202e", "\x00", "a" * 1000):
        for extension in ("toml", "json", "yaml"):
            file = tmp_path / f"key.{extension}"
            mf.save(file, mf.Graph(), mf.Values({key: ZERO}), force=True)
            assert list(mf.load(file, anchor=False)[1]) == [key]


@pytest.mark.parametrize(
    "bad",
    [
        lambda graph, values: values.__setitem__("", ZERO),
        lambda graph, values: mf.Values({"": ZERO}),
        lambda graph, values: values.insert_many([""], mf.Point1, {"position": np.ones((1, 1))}),
        lambda graph, values: graph.add("", mf.prior_se2(value=ZERO)),
        lambda graph, values: graph.add_many("prior_se2", ["a", ""], {"value": ZERO}),
        lambda graph, values: graph.fix(""),
    ],
)
def test_an_empty_key_is_refused(bad: Any) -> None:
    with pytest.raises(mf.ArgumentError, match="at least one character"):
        bad(mf.Graph(), mf.Values())


@pytest.mark.parametrize(
    "thing",
    [
        mf.huber(),
        mf.levenberg_marquardt(),
        mf.range_se2_point2(range=2.0),
        mf.starts.given(),
        mf.Point2(position=[0, 0]),
        mf.ValueArray([mf.Point2(position=[0, 0])]),
    ],
)
def test_an_attribute_of_an_object_does_not_change(thing: Any) -> None:
    for name in ("scale", "position", "stop", "unknown"):
        with pytest.raises(AttributeError, match=f"does not change: create a new one with another `{name}`"):
            setattr(thing, name, 1.0)


def test_a_graph_may_change_while_it_is_solved() -> None:
    added: list[bool] = []

    def observer(_: dict[str, Any]) -> None:
        graph.add(mf.prior("a", ZERO))
        values["c"] = ZERO
        added.append(True)

    @mf.batch(rows=1)
    def bend(x: mf.Se2) -> Any:
        graph.free("b")
        return x.translation[:, 0] ** 3

    graph, values = pair()
    graph.add("a", bend())
    solution = mf.solve(graph, values, observer=observer)
    assert added and len(solution.graph) == 3 and len(graph) == 3 + len(added)
    assert graph.cost(values) >= 0 and not graph.check(values)


def test_a_graph_may_change_while_its_arguments_are_read() -> None:
    class Keys:
        def __iter__(self) -> Iterator[str]:
            graph.add(mf.prior("b", ZERO))
            values["b"] = ZERO
            yield "a"

    graph, values = mf.Graph(), mf.Values()
    keys: Any = Keys()
    assert graph.add(keys, mf.prior_se2(value=ZERO)) == 1
    assert graph.add_many(mf.prior_se2, keys, {"value": ZERO}) == (3, 4)
    values.insert_many(keys, mf.Se2, {"translation": [0, 0], "angle": 0})
    assert [graph[i].keys for i in range(4)] == [["b"], ["a"], ["b"], ["a"]] and set(values) == {"a", "b"}
