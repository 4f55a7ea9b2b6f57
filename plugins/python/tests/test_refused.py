"""Adding a factor or a noise that no solve accepts is an error."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import manifactor as mf
import numpy as np
import pytest

ZERO = mf.Se2(translation=[0, 0], angle=0)
STEP = mf.between_se2(relative=ZERO)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: mf.Noise(sigmas=[]), "sigmas: expected a number for each row of the residual, got none"),
        (lambda: mf.Noise(sigmas=np.empty(0)), "sigmas: expected a number for each row"),
        (lambda: mf.Noise(covariance=np.empty((0, 0))), "covariance: expected a number for each row"),
        (lambda: mf.Noise(information=np.empty((2, 0))), "information: expected a number for each row"),
        (lambda: mf.Noise(sigma=np.empty(0)), r"sigma: expected an array of shape \(,?\)"),  # type: ignore[arg-type]
        (lambda: mf.Noise(observed=[]), "observed: expected a row that was measured"),
        (lambda: mf.Noise(sigma=1, observed=[False, False]), "observed: expected a row that was measured"),
        (lambda: mf.Noise(sigmas=[1, 2], observed=[True]), "observed: the noise has 2 rows, the residual 1"),
        (lambda: mf.Noise(covariance=np.eye(2), observed=[True] * 3), "observed: the noise has 2 rows"),
        (lambda: mf.Noise(sigmas=[1, -2]), "sigmas: a standard deviation"),
    ],
)
def test_a_noise_of_no_rows_is_refused(made: Callable[[], Any], message: str) -> None:
    with pytest.raises(mf.ArgumentError, match=message):
        made()


@pytest.mark.parametrize(
    ("keys", "options", "message"),
    [
        ("a", {}, "between_se2.*2 variables.*1|1.*2"),
        ([], {}, "between_se2"),
        (["a", "b", "c"], {}, "between_se2"),
        (["a", "a"], {}, "`a`"),
        (["a", "b"], {"noise": mf.Noise(sigmas=[1, 1])}, r"the noise has 2 rows, the residual 3 \(x, y, theta\)"),
        (["a", "b"], {"noise": mf.Noise(covariance=np.eye(6))}, "the noise has 6 rows, the residual 3"),
        (["a", "b"], {"noise": mf.Noise(observed=[True])}, "the noise has 1 row, the residual 3"),
    ],
)
def test_a_factor_that_fits_no_values_is_refused(keys: Any, options: Any, message: str) -> None:
    graph = mf.Graph()
    graph.add(["a", "b"], STEP)
    with pytest.raises(mf.GraphError, match=message):
        graph.add(keys, STEP, **options)
    if keys:
        with pytest.raises(mf.GraphError, match=message):
            graph.add_many(STEP, [["a", "b"][: len(keys)] if options else keys], **options)
    assert len(graph) == 1


def test_a_row_with_a_key_twice_is_refused_and_nothing_is_added() -> None:
    graph = mf.Graph()
    with pytest.raises(mf.GraphError, match="factor 2.*`x3`"):
        graph.add_many(STEP, np.array([[0, 1], [1, 2], [3, 3]]))
    assert len(graph) == 0


@pytest.mark.parametrize("rows", [2, 4])
def test_columns_of_noise_of_another_size_are_refused(rows: int) -> None:
    graph = mf.Graph()
    with pytest.raises(mf.GraphError, match=f"the noise has {rows} rows, the residual 3"):
        graph.add_many(STEP, np.array([[0, 1], [1, 2]]), noise={"sigmas": np.ones((2, rows))})
    assert len(graph) == 0


def ones(*shape: int) -> Callable[..., Any]:
    return lambda *_: np.ones(shape)


@pytest.mark.parametrize("shape", [(1, 1, 2), (1, 2), (2,), (), (3, 2), (3, 2, 1), (3, 1, 1), (2, 1, 2), (4, 1, 2)])
@pytest.mark.parametrize("solve", ["solve", "session"])
def test_a_jacobian_of_another_shape_is_refused(shape: tuple[int, ...], solve: str) -> None:
    @mf.batch(rows=1, jacobian=ones(*shape))
    def total(a: mf.Point2) -> Any:
        return a.sum(axis=1)

    graph, values = mf.Graph(), mf.Values()
    values.insert_many(np.arange(3), mf.Point2, {"position": np.ones((3, 2))})
    graph.add_many(total, np.arange(3)[:, None], {})
    with pytest.raises(mf.ArgumentError, match=r"expected an array of shape \(3, 1, 2\)"):
        if solve == "solve":
            mf.solve(graph, values)
        else:
            session = mf.Smoother()
            session.push(graph, values)
            session.update()


@pytest.mark.parametrize("number", [0, 1, 3])
def test_another_number_of_jacobians_is_refused(number: int) -> None:
    @mf.batch(rows=1, jacobian=lambda a, b: [np.ones((len(a), 1, 2))] * number)
    def total(a: mf.Point2, b: mf.Point2) -> Any:
        return (a - b).sum(axis=1)

    graph, values = mf.Graph(), mf.Values()
    values.insert_many(np.arange(3), mf.Point2, {"position": np.ones((3, 2))})
    graph.add_many(total, np.array([[0, 1], [1, 2]]), {})
    with pytest.raises(mf.ArgumentError, match=f"a Jacobian for each of 2 variables, got {number}"):
        mf.solve(graph, values)


@pytest.mark.parametrize("shape", [(), (1,), (2,), (1, 1), (3, 2), (1, 3)])
def test_a_residual_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    total = mf.batch(rows=1)(named(ones(*shape)))
    graph, values = mf.Graph(), mf.Values()
    values.insert_many(np.arange(3), mf.Point2, {"position": np.ones((3, 2))})
    graph.add_many(total, np.arange(3)[:, None], {})
    with pytest.raises(mf.ArgumentError, match="the residual: expected an array of shape"):
        mf.solve(graph, values)


def named(returns: Callable[..., Any]) -> Callable[..., Any]:
    def total(a: mf.Point2) -> Any:
        return returns(a)

    return total
