"""Keys as texts, numbers and pairs, and the methods of graphs and values that take them."""

from __future__ import annotations

import pickle
from collections import ChainMap
from types import MappingProxyType
from typing import Any

import manifactor as mf
import numpy as np
import pytest


def chain() -> tuple[mf.Graph, mf.Values]:
    graph, values = mf.Graph(), mf.Values()
    graph.add(0, mf.prior_se2(value=mf.Se2(translation=[0, 0], angle=0)), noise=0.1)
    graph.add([0, 1], mf.between_se2(relative=mf.Se2(translation=[1, 0], angle=0)), noise=0.1)
    graph.add([1, ("x", 2)], mf.between_se2(relative=mf.Se2(translation=[1, 0], angle=0)), noise=0.1)
    for i in range(3):
        values["x", i] = mf.Se2(translation=[0, 0], angle=0)
    return graph, values


def test_numbers_and_pairs_are_texts_with_a_prefix() -> None:
    graph, values = chain()
    assert [graph[i].keys for i in range(3)] == [["x0"], ["x0", "x1"], ["x1", "x2"]]
    assert values.keys() == ["x0", "x1", "x2"]
    solution = mf.solve(graph, values)
    x: Any = solution.values["x", 2]
    assert x == solution.values["x2"] == solution.values[2] == solution.values[np.int64(2)]
    assert np.allclose(x.translation, [2, 0])
    assert 2 in values and ("x", 2) in values and ("y", 2) not in values and 2.5 not in values
    assert set(solution.covariances([1, ("x", 2)])) == {"x1", "x2"}
    graph.fix(("x", 1))
    assert dict(graph.fixed) == {"x1": True}
    graph.free(1)
    assert not graph.fixed


@pytest.mark.parametrize("key", [1.5, True, None, ("x", 1.5), ("x", "y"), ("x", 1, 2), (1, 1), ""])
def test_what_is_no_key_is_refused(key: Any) -> None:
    values = mf.Values()
    with pytest.raises(mf.ArgumentError, match="key"):
        values[key] = mf.Point1(position=[1.0])
    assert key not in values and len(values) == 0


def test_values_are_read_and_updated_as_a_dict_is() -> None:
    _, values = chain()
    other = mf.Values({7: mf.Point1(position=[7.0]), ("p", 1): mf.Point1(position=[1.0])})
    assert [key for key, _ in other.items()] == ["x7", "p1"]
    assert other.get("p1") == mf.Point1(position=[1.0]) and other.get("p2") is None
    assert other.get(8, other[7]) == mf.Point1(position=[7.0])
    values.update(other)
    values.update({"x7": mf.Point1(position=[8.0])})
    values.update(values)
    assert values.keys() == ["x0", "x1", "x2", "x7", "p1"] and values[7] == mf.Point1(position=[8.0])
    solution = mf.solve(*chain())
    with pytest.raises(mf.GraphError, match=r"copy\.copy"):
        solution.values.update(other)


def test_graphs_add_up() -> None:
    graph, values = chain()
    closure = mf.Graph()
    closure.add([0, 2], mf.between_se2(relative=mf.Se2(translation=[2.3, 0], angle=0)), noise=0.1)
    closure.fix(0)
    both = graph + closure
    assert (len(graph), len(closure), len(both)) == (3, 1, 4) and dict(both.fixed) == {"x0": True}
    x: Any = mf.solve(both, values).values[2]
    assert np.allclose(x.translation, [2.2, 0])
    graph += closure
    assert len(graph) == 4 and graph.to_document(values) == both.to_document(values)
    graph += graph
    assert len(graph) == 8


def test_numbers_of_the_type_object_have_their_prefix() -> None:
    pandas = pytest.importorskip("pandas")
    rows = pandas.DataFrame({"pose": [0, 0], "landmark": [1, 2]})
    for table in (rows, rows.astype("Int64"), rows.astype(object)):
        graph = mf.Graph()
        graph.add_many(mf.range_se3_point3, table, {"range": np.ones(2)}, prefix=["x", "l"])
        assert [graph[i].keys for i in range(2)] == [["x0", "l1"], ["x0", "l2"]]
    values, points = mf.Values(), {"position": np.zeros((2, 1))}
    values.insert_many(np.array([1, 2], dtype=object), mf.Point1, points, prefix="l")
    values.insert_many(pandas.Series(["a", "b"]), mf.Point1, points)
    assert values.keys() == ["l1", "l2", "a", "b"]
    for texts in (np.array(["a1", "a2"]), np.array(["a1", 2], dtype=object), ["a1", "a2"]):
        with pytest.raises(mf.ArgumentError, match="keys: expected whole numbers"):
            values.insert_many(texts, mf.Point1, points, prefix="l")


def test_large_numbers_are_not_rounded() -> None:
    stamps = np.array([1700000000123456789, 2**62 + 1])
    for of in (stamps, stamps.astype(np.uint64), stamps.astype(object), stamps[::-1][::-1]):
        values = mf.Values()
        values.insert_many(of, mf.Point1, {"position": np.zeros((2, 1))})
        assert values.keys() == [f"x{stamp}" for stamp in stamps] and int(stamps[0]) in values
    graph = mf.Graph()
    graph.add_many("prior_point1", stamps[:, None], {"value": {"position": [0]}})
    assert graph[1].keys == [f"x{stamps[1]}"]
    with pytest.raises(mf.ArgumentError, match=r"expected whole numbers below 2\^63, got 18446744073709551615"):
        values.insert_many(np.array([2**64 - 1], dtype=np.uint64), mf.Point1, {"position": np.zeros((1, 1))})


@pytest.mark.parametrize("keys", [{"a", "b"}, frozenset({"a", "b"})])
def test_a_set_has_no_order(keys: Any) -> None:
    between = mf.between_point1(relative=mf.Point1(position=[1]))
    for call in (
        lambda: mf.FactorEntry(keys, between),
        lambda: mf.Graph().add(keys, between),
        lambda: mf.Graph().add_many(between, [keys]),
        lambda: mf.Values().insert_many(keys, mf.Point1, {"position": np.zeros((2, 1))}),
    ):
        with pytest.raises(TypeError, match="set, which has no order"):
            call()


def test_covariances_of_no_keys_are_empty() -> None:
    graph, values = chain()
    solution = mf.solve(graph, values)
    assert solution.covariances([]) == {} and len(solution.covariances()) == 3
    # their order does not matter
    assert set(solution.covariances({"x1", "x2"})) == {"x1", "x2"}  # type: ignore[arg-type]


def test_values_of_any_mapping() -> None:
    point = mf.Point1(position=[1])
    values = mf.Values(MappingProxyType({"a": point}))
    values.update(ChainMap({"b": point}, {"c": point}))
    values.insert_many(["d"], mf.Point1, MappingProxyType({"position": [1]}))
    graph = mf.Graph()
    graph.add_many(mf.prior_point1, ["a"], ChainMap({"value": {"position": [1]}}))
    assert set(values) == {"a", "b", "c", "d"} and len(graph) == 1
    with pytest.raises(TypeError):
        mf.Values([("a", point)])  # type: ignore[arg-type]


def test_an_id_of_a_factor_is_pickled_with_its_smoother() -> None:
    graph, values = chain()
    smoother = mf.Smoother()
    ids = smoother.push(graph, values)
    smoother.update()
    smoother, again = pickle.loads(pickle.dumps((smoother, ids)))
    assert again == ids and len({*again, *ids}) == 3
    smoother.remove(again[2:])
    smoother.update()
    assert len(smoother.graph()) == 2
    with pytest.raises(mf.GraphError, match="there is no factor 2"):
        smoother.remove(again[2:])


def test_what_is_fixed_and_bounded_adds_up() -> None:
    graph = mf.Graph()
    graph.fix("a", ["x"])
    graph.fix("a", ["y"])
    graph.bound("b", "x", min=0.0)
    graph.bound("b", "x", max=9.0)
    other = mf.Graph()
    other.fix("a", ["z"])
    other.bound("b", "x", max=5.0)
    both = graph + other
    assert graph.fixed["a"] == ["x", "y"] and graph.bounds["b"]["x"] == (0.0, 9.0)
    assert both.fixed["a"] == ["x", "y", "z"] and both.bounds["b"]["x"] == (0.0, 5.0)
