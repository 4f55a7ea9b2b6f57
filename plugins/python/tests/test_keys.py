"""Keys as texts, numbers and pairs, and the methods of graphs and values that take them."""

from __future__ import annotations

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
