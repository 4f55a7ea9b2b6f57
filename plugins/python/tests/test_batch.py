"""Factors that Python evaluates for a whole batch in one call."""

from __future__ import annotations

from typing import Any

import manifactor as mf
import numpy as np
import pytest

RNG = np.random.default_rng(5)


def numbers(of: str) -> Any:
    """A range factor with the chosen kind of derivatives, and a record of its calls."""
    calls: list[int] = []

    def by_hand(x: Any, p: Any, measured: Any) -> Any:
        away = x[:, 4:] - p
        unit = away / np.linalg.norm(away, axis=1, keepdims=True)
        return [np.concatenate([np.zeros((len(x), 4)), unit], axis=1)[:, None], -unit[:, None]]

    @mf.batch(rows=1, jacobian=by_hand if of == "by hand" else of)
    def ranges(x: mf.Se3, p: mf.Point3, measured: Any) -> Any:
        calls.append(len(x))
        return np.linalg.norm(x[:, 4:] - p, axis=1) - measured

    return ranges, calls


def scene(factor: Any, n: int = 30) -> tuple[mf.Graph, mf.Values]:
    rng = np.random.default_rng(6)
    graph, values = mf.Graph(), mf.Values()
    points, at = rng.normal(size=(n, 3)) * 5, rng.normal(size=(n, 3))
    values.insert_many(np.arange(n), mf.Se3, {"translation": at, "rotation": np.tile([0.0, 0, 0, 1], (n, 1))})
    values.insert_many(np.arange(n), mf.Point3, {"position": points + 0.1 * rng.normal(size=(n, 3))}, prefix="p")
    keys = np.stack(np.meshgrid(np.arange(n), np.arange(n)), axis=-1).reshape(-1, 2)
    keys = keys[: 10 * n]
    distances = np.linalg.norm(at[keys[:, 0]] - points[keys[:, 1]], axis=1)
    name = "measured" if isinstance(factor, mf.BatchFactor) else "range"
    graph.add_many(factor, keys, {name: distances}, prefix=["x", "p"], noise=0.1, loss=mf.huber())
    graph.add_many(
        mf.prior_se3,
        np.arange(n)[:, None],
        {"value": {"translation": at, "rotation": np.tile([0.0, 0, 0, 1], (n, 1))}},
        noise=0.01,
    )
    graph.add_many(mf.prior_point3, np.arange(n)[:, None], {"value": {"position": points}}, prefix="p", noise=1.0)
    return graph, values


@pytest.mark.parametrize("of", ["by hand", "differences", "jax"])
def test_a_batch_is_solved_as_the_built_in_factor_is(of: str) -> None:
    if of == "jax":
        pytest.importorskip("jax")
        import jax.numpy as jnp

        @mf.batch(rows=1)
        def ranges(x: mf.Se3, p: mf.Point3, measured: Any) -> Any:
            return jnp.linalg.norm(x[:, 4:] - p, axis=1) - measured
    else:
        ranges, calls = numbers(of)
    expected, found = mf.solve(*scene(mf.range_se3_point3)), mf.solve(*scene(ranges))
    assert found.converged and found.cost == pytest.approx(expected.cost, rel=1e-9)
    np.testing.assert_allclose(found.values["x3"].translation, expected.values["x3"].translation, atol=1e-6)
    np.testing.assert_allclose(found.costs, expected.costs, atol=1e-7)
    np.testing.assert_allclose(found.covariances(["p2"])["p2"], expected.covariances(["p2"])["p2"], rtol=1e-5, atol=1e-9)
    if of == "by hand":
        # whole batches: one call for each linearization and each cost
        assert set(calls) == {300} and len(calls) < 10 * found.iterations + 10


def test_one_factor_alone() -> None:
    ranges, _ = numbers("differences")
    factor = ranges(measured=2.0)
    x, p = mf.Se3(translation=[0, 0, 0], rotation=[0, 0, 0, 1]), mf.Point3(position=[3, 0, 4])
    residual, jacobians = factor.linearize(x, p)
    assert residual == pytest.approx([3.0]) and [j.shape for j in jacobians] == [(1, 6), (1, 3)]
    _, exact = mf.range_se3_point3(range=2.0).linearize(x, p)
    for ours, theirs in zip(jacobians, exact, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-9)
    assert mf.check_factor(factor).holds
    assert repr(ranges) == "<batch factor ranges(x: Se3, p: Point3, measured), 1 rows>"


def test_two_functions_are_two_batches_and_constants_have_shapes() -> None:
    @mf.batch(rows=2)
    def affine(p: mf.Point2, matrix: Any, offset: Any) -> Any:
        return np.einsum("nij,nj->ni", matrix, p) - offset

    @mf.batch(rows=1)
    def first(p: mf.Point2) -> Any:
        return p[:, 0] - 7

    graph = mf.Graph()
    matrices = RNG.normal(size=(3, 2, 2)) + 3 * np.eye(2)
    graph.add_many(affine, ["a", "b", "c"], {"matrix": matrices, "offset": (1.0, 2.0)})
    graph.add("a", first(), noise=1e-4)
    solution = mf.solve(graph, mf.Values({key: mf.Point2(position=[0, 0]) for key in "abc"}))
    np.testing.assert_allclose(solution.values["b"].position, np.linalg.solve(matrices[1], [1, 2]), atol=1e-8)
    assert solution.values["a"].position[0] == pytest.approx(7, abs=1e-4)
    assert affine.rows == 2


def test_a_session_takes_them() -> None:
    ranges, calls = numbers("by hand")
    session = mf.Smoother(relinearize_every=1)
    graph, values = scene(ranges, 5)
    session.push(graph, values)
    session.update()
    finished, outcome = session.finish()
    assert outcome["termination"]["status"] == "converged" and calls
    assert session.cost() >= outcome["final_cost"] - 1e-9


def test_rows_that_are_no_numbers_take_no_part() -> None:
    @mf.batch(rows=1)
    def positive(p: mf.Point1) -> Any:
        with np.errstate(invalid="ignore"):
            return np.where(p[:, 0] > 0, p[:, 0] - 1, np.nan)

    graph = mf.Graph()
    graph.add_many(positive, ["a", "b"])
    graph.add("b", mf.prior_point1(value=mf.Point1(position=[-2])))
    values = mf.Values({"a": mf.Point1(position=[3]), "b": mf.Point1(position=[-1])})
    solution = mf.solve(graph, values)
    assert solution.outcome["inactive"] == 1 and solution.values["a"].position == pytest.approx(1)


def test_what_a_function_raises_ends_the_solve() -> None:
    @mf.batch(rows=1)
    def fails(p: mf.Point1) -> Any:
        raise LookupError("within the solve")

    @mf.batch(rows=2)
    def too_few(p: mf.Point1) -> Any:
        return p

    @mf.batch(rows=1, jacobian=lambda p: np.zeros((len(p), 2, 1)))
    def wrong(p: mf.Point1) -> Any:
        return p

    values = mf.Values({"a": mf.Point1(position=[3])})
    for factor, error, message in [
        (fails, LookupError, "within the solve"),
        (too_few, mf.ArgumentError, r"too_few: the residual: expected an array of shape \(3, 2\), got \(3, 1\)"),
        (wrong, mf.ArgumentError, r"wrong: the Jacobian: expected an array of shape \(1, 1, 1\), got \(1, 2, 1\)"),
    ]:
        graph = mf.Graph()
        graph.add("a", factor())
        with pytest.raises(error, match=message):
            mf.solve(graph, values)
    # no exception is left over
    graph = mf.Graph()
    graph.add("a", mf.prior_point1(value=mf.Point1(position=[1])))
    assert mf.solve(graph, values).converged


def test_it_cannot_be_saved_and_says_so() -> None:
    ranges, _ = numbers("by hand")
    graph, values = scene(ranges, 3)
    with pytest.raises(mf.ArgumentError, match="`ranges` is a function of Python, which no document can hold"):
        graph.to_document(values)


def test_mistakes_in_a_declaration() -> None:
    with pytest.raises(mf.ArgumentError, match='jacobian: expected a function, "jax" or "differences", got \'exact\''):
        mf.batch(rows=1, jacobian="exact")(lambda: None)

    @mf.batch(rows=99)
    def long(p: mf.Point1) -> Any:
        return p

    with pytest.raises(mf.ArgumentError, match="rows: expected a residual of 1 to 48 rows, got 99"):
        long()
    ranges, _ = numbers("by hand")
    with pytest.raises(TypeError, match="ranges: missing the constant `measured`"):
        ranges()
    with pytest.raises(mf.ArgumentError, match="measured: expected an array of 2 rows, one for each, got shape"):
        mf.Graph().add_many(ranges, [("a", "b"), ("c", "d")], {"measured": np.ones(3)})


def test_a_function_may_change_its_arrays() -> None:
    def distance(x: Any, p: Any) -> Any:
        away = x.translation
        away -= p
        return np.linalg.norm(away, axis=1)

    def by_hand(x: Any, p: Any) -> Any:
        away = x.translation - p
        unit = (away / np.linalg.norm(away, axis=1, keepdims=True))[:, None, :]
        return np.concatenate([np.zeros((len(x), 1, 4)), unit], axis=2), -unit

    @mf.batch(rows=1, jacobian=by_hand)
    def hand(x: mf.Se3, p: mf.Point3) -> Any:
        return distance(x, p)

    @mf.batch(rows=1)
    def differences(x: mf.Se3, p: mf.Point3) -> Any:
        return distance(x, p)

    at = mf.Se3(translation=[1, 2, 3], rotation=[0, 0, 0, 1]), mf.Point3(position=[4, 6, 3])
    for factor in (hand(), differences()):
        residual, jacobians = factor.linearize(*at)
        assert residual == pytest.approx([5.0])
        np.testing.assert_allclose(jacobians[1], [[0.6, 0.8, 0]], atol=1e-9)


@pytest.mark.parametrize("size", [1.2e-5, 1.0, 1e4, 1e8])
def test_differences_fit_the_size_of_a_variable(size: float) -> None:
    @mf.batch(rows=1)
    def decay(k: mf.Point1) -> Any:
        return np.exp(-np.asarray(k) / size)

    _, [jacobian] = decay().linearize(mf.Point1(position=[size]))
    np.testing.assert_allclose(jacobian * size, [[-np.exp(-1)]], rtol=1e-5)


def test_differences_see_details_far_from_the_origin() -> None:
    @mf.batch(rows=1)
    def local(k: mf.Point1) -> Any:
        return np.sin(np.asarray(k) - 5e6)

    _, [jacobian] = local().linearize(mf.Point1(position=[5e6 + 0.5]))
    np.testing.assert_allclose(jacobian, [[np.cos(0.5)]], rtol=1e-5)


def test_single_precision_needs_a_jacobian() -> None:
    def pixel(x: mf.Point1) -> Any:
        return np.float32(600) + np.float32(3) * np.asarray(x, dtype=np.float32)

    at = mf.Point1(position=[0.1])
    with pytest.raises(mf.ArgumentError, match="the residual: expected float64, got float32.*pass `jacobian`"):
        mf.batch(rows=1)(pixel)().linearize(at)
    _, [jacobian] = mf.batch(rows=1, jacobian=lambda x: np.full((1, 1, 1), 3))(pixel)().linearize(at)
    assert jacobian == pytest.approx(3)


def test_a_factor_of_a_function_is_equal_to_itself_only() -> None:
    ranges, _ = numbers("by hand")
    factor, other = ranges(measured=1.0), ranges(measured=1.0)
    assert factor == factor and factor != other and hash(factor) == hash(factor)
    assert not hasattr(factor, "anything") and factor != mf.range_se3_point3(range=1.0)
    graph = mf.Graph()
    for of in (factor, other):
        graph.add(["x", "p"], of)
    assert graph[0] == graph[0] and graph[0] != graph[1] and list(graph).index(graph[1]) == 1


def test_series_and_masked_arrays_are_constants() -> None:
    pandas = pytest.importorskip("pandas")

    @mf.batch(rows=1)
    def offset(p: mf.Point1, z: Any) -> Any:
        return np.asarray(p) - z[:, None]

    @mf.factor
    def traced(a: mf.Point1, z: Any) -> Any:
        return a - z

    at = mf.Point1(position=[0])
    for factor in (offset, traced):
        graph = mf.Graph()
        graph.add_many(factor, ["a", "b"], {"z": pandas.Series([1.0, 2.0])})
        assert [graph[i].factor.residual(at)[0] for i in range(2)] == [-1, -2]
        with pytest.raises(mf.ArgumentError, match="without masked entries"):
            graph.add_many(factor, ["a", "b"], {"z": np.ma.masked_equal([1.0, 2.0], 2.0)})


def test_jax_uses_the_present_numbers_of_a_function() -> None:
    pytest.importorskip("jax")
    import jax.numpy as jnp

    weights, gain = np.array([1.0]), 1.0

    @mf.batch(rows=1)
    def model(x: mf.Point1) -> Any:
        return jnp.asarray(x) * weights[0] * gain - 6.0

    factor, at = model(), mf.Point1(position=[2.5])
    assert factor.linearize(at)[1][0] == pytest.approx(1)
    weights[0] = 3.0
    residual, [jacobian] = factor.linearize(at)
    assert residual == pytest.approx(1.5) and jacobian == pytest.approx(3)
    gain = 2.0
    assert factor.linearize(at)[1][0] == pytest.approx(6)


def test_a_formula_uses_the_present_numbers_of_its_function() -> None:
    gain = 1.0

    def scale(a: Any) -> Any:
        return a * gain

    @mf.factor
    def scaled(a: mf.Point1, m: Any) -> Any:
        return scale(a) - m

    graph = mf.Graph()
    for gain, m in ((1.0, 1.0), (2.0, 4.0), (3.0, 9.0)):
        graph.add("a", scaled(m=m))
    at = mf.Point1(position=[1.0])
    assert [graph[i].factor.residual(at)[0] for i in range(3)] == [0, -2, -6]


def test_a_masked_residual_is_refused() -> None:
    @mf.batch(rows=1)
    def masked(p: mf.Point1) -> Any:
        return np.ma.masked_array(p, mask=True)

    graph, values = mf.Graph(), mf.Values({"p": mf.Point1(position=[1])})
    graph.add_many(masked, [["p"]])
    with pytest.raises(mf.ManifactorError, match="expected an array without masked entries"):
        mf.solve(graph, values)
