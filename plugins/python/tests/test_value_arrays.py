"""Arrays of values, and fields under one name everywhere."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import manifactor as mf
import numpy as np
import pytest

N = 5
XI = np.random.default_rng(1).normal(size=(N, 6))
POSES = mf.Se3.exp(XI)


def test_an_array_is_indexed_like_one_of_numpy() -> None:
    assert POSES[0] == mf.Se3.exp(XI[0]) and POSES[-1] == POSES[N - 1] and POSES[np.int64(2)] == POSES[2]
    assert POSES[1:3] == mf.ValueArray([POSES[1], POSES[2]]) and len(POSES[::2]) == 3 and len(POSES[9:]) == 0
    assert POSES[np.arange(N) > 2] == POSES[3:] and POSES[[3, 3]] == mf.ValueArray([POSES[3]] * 2)
    assert POSES[::-1] == mf.ValueArray(reversed(list(POSES))) and len(list(POSES)) == N
    for wrong in (N, -N - 1, [0, N]):
        with pytest.raises(IndexError):
            POSES[wrong]
    with pytest.raises(IndexError):
        POSES["translation"]
    with pytest.raises(mf.ArgumentError, match="expected an index of one axis"):
        POSES[np.zeros((1, 1), int)]


def test_an_array_has_the_fields_and_functions_of_its_values() -> None:
    np.testing.assert_array_equal(POSES.translation, [x.translation for x in POSES])
    np.testing.assert_array_equal(POSES.rotation, POSES.fields()["rotation"])
    np.testing.assert_array_equal(POSES.position, POSES.translation)
    assert POSES.numbers().shape == (N, 7)
    with pytest.raises(ValueError, match="read-only"):
        POSES.translation[0] = 0
    planar = mf.Se2.exp(XI[:, :3])
    assert planar.angle.shape == (N,) and planar.rotation == mf.So2.exp(XI[:, 2:3])
    twists = mf.ValueArray([mf.Twist(angular=[0, 1, 2], linear=[3, 4, 5])] * 2)
    np.testing.assert_array_equal(twists.linear, [[3, 4, 5]] * 2)
    with pytest.raises(mf.ArgumentError, match="has fields only"):
        twists.numbers()
    with pytest.raises(AttributeError, match="has no field `heading`: there are translation, rotation|rotation, translation"):
        POSES.heading
    points = mf.Point3.from_fields({"position": np.eye(3)})
    np.testing.assert_array_equal(points.norm, np.ones(3))
    np.testing.assert_array_equal(points - [1, 0, 0], np.eye(3) - [1, 0, 0])
    np.testing.assert_array_equal(np.asarray(points), np.eye(3))


def test_arrays_are_values_too() -> None:
    assert repr(POSES) == f"ValueArray({N} se3)" and POSES.type == "se3"
    assert mf.Se3.exp(XI) == POSES and POSES != POSES[1:] and POSES != POSES[::-1] and POSES != 3
    again = [pickle.loads(pickle.dumps(POSES)), copy.copy(POSES), copy.deepcopy(POSES), mf.ValueArray(POSES)]
    assert all(type(array) is mf.ValueArray and array == POSES for array in again)
    with pytest.raises(TypeError, match="unhashable"):
        hash(POSES)


def test_an_array_may_be_empty() -> None:
    empty: mf.ValueArray[mf.Se3] = mf.ValueArray([], mf.Se3)
    assert len(empty) == 0 and empty == mf.Se3.exp(np.zeros((0, 6))) and empty == POSES[:0]
    assert (empty * empty).matrix().shape == (0, 4, 4) and empty.log().shape == (0, 6)
    assert (empty @ np.zeros((0, 3))).shape == (0, 3) and empty.translation.shape == (0, 3)
    assert mf.Se3.from_matrix(np.zeros((0, 4, 4))) == empty == pickle.loads(pickle.dumps(empty))


def test_graphs_and_values_take_arrays() -> None:
    values = mf.Values()
    values.insert_many(np.arange(N), POSES)
    assert [values[f"x{i}"] for i in range(N)] == list(POSES)
    assert mf.Se3.from_fields(values.columns(mf.Se3)[1]) == POSES
    graph = mf.Graph()
    keys = np.stack([np.arange(N - 1), np.arange(1, N)], axis=1)
    steps = POSES[:-1].between(POSES[1:])
    graph.add_many(mf.between_se3, keys, {"relative": steps})
    graph.fix("x0")
    assert graph[2].factor == mf.between_se3(relative=steps[2])
    assert mf.solve(graph, values).cost < 1e-20


@mf.factor
def apart(x: mf.Se3, y: mf.Se3, relative: Any) -> Any:
    error = relative.inverse() * x.between(y)
    return [error.translation, error.log()]


def test_an_array_is_a_constant_of_a_traced_factor() -> None:
    values, graph = mf.Values(), mf.Graph()
    values.insert_many(np.arange(N), POSES)
    keys = np.stack([np.arange(N - 1), np.arange(1, N)], axis=1)
    graph.add_many(apart, keys, {"relative": POSES[:-1].between(POSES[1:])})
    graph.fix("x0")
    assert mf.solve(graph, values).cost < 1e-20


WRONG: dict[str, tuple[Any, str]] = {
    "mixed types": (lambda: mf.ValueArray([POSES[0], mf.Se2.identity()]), r"values\[1\]: expected values of one type, got `se3` and `se2`"),
    "another type than named": (lambda: mf.ValueArray([POSES[0]], mf.Se2), "got `se2` and `se3`"),
    "no type": (lambda: mf.ValueArray([]), "type: expected a type of values"),
    "an unknown type": (lambda: mf.ValueArray([], "se4"), "unknown variable `se4`"),
    "no iterable": (lambda: mf.ValueArray(3), "expected values of one type"),  # type: ignore[arg-type]
    "unequal lengths": (lambda: POSES * POSES[1:], r"equal leading axes, got \[5\] and \[4\]"),
    "unequal points": (lambda: POSES @ np.zeros((4, 3)), r"equal leading axes, got \[5\] and \[4\]"),
    "unequal steps": (lambda: POSES.retract(np.zeros((4, 6))), "equal numbers of rows, got 5 and 4"),
    "unequal ends": (lambda: POSES.local(POSES[1:]), "equal numbers of rows, got 5 and 4"),
    "unequal fractions": (lambda: POSES.interpolate(POSES, [0, 1]), r"t: expected a number or an array of shape \(5,\), got one of shape \(2,\)"),
    "no group": (lambda: mf.ValueArray([mf.Point3(position=[0, 0, 0])]).inverse(), "`inverse` does not take vector3"),
    "no matrices": (lambda: mf.ValueArray([mf.Point3(position=[0, 0, 0])]).matrix(), "`point3` has no matrices.*so2, so3, se2, se3"),
    "no columns": (lambda: mf.Se3.from_fields({"translation": [0, 0, 0]}), "at least one array"),
    "a wide column": (lambda: mf.Se2.from_fields({"translation": np.zeros((3, 3)), "angle": 0}), "translation, row 0: expected 2 numbers"),
    "columns of different lengths": (
        lambda: mf.Se2.from_fields({"translation": np.zeros((3, 2)), "angle": np.zeros(4)}),
        "angle: expected an array of 3 rows",
    ),
    "too few keys": (lambda: mf.Values().insert_many(np.arange(N - 1), POSES), "expected 4 values, one for each key, got 5"),
    "fields of an array": (lambda: mf.Values().insert_many(np.arange(N), POSES, {}), "leave them out"),
    "a type without fields": (lambda: mf.Values().insert_many(np.arange(N), mf.Se3), "expected the fields of a `se3`"),
    "too few factors": (
        lambda: mf.Graph().add_many(mf.between_se3, [["a", "b"]], {"relative": POSES}),
        "expected an array of 1 rows, one for each, got 5 rows",
    ),
    "an array for one value": (lambda: mf.between_se3(relative=POSES), "relative"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_array_is_an_error_that_names_it(name: str) -> None:
    call, message = WRONG[name]
    with pytest.raises(mf.ArgumentError, match=message):
        call()


@mf.factor
def by_fields(x: mf.Se3, y: mf.Se2, p: mf.Point3, q: mf.DualQuadric, r: mf.So3, s: mf.So2, d: mf.S2) -> Any:
    return [
        x.rotation @ (x.translation - p.position),
        y.translation - [y.angle, s.angle],
        q.translation - q.semi_axes,
        (r.rotation @ d.direction) - d.direction,
    ]


def test_a_traced_factor_has_the_fields_of_its_variables() -> None:
    formulas = by_fields().to_dict()["residual"]
    assert formulas[0] == "rotation(x) * (position(x) - p)"
    assert formulas[1] == "position(y) - [angle(rotation(y)), angle(s)]"


@mf.factor
def seen(x: mf.Se3, p: mf.Point3) -> Any:
    at = x.inverse() * p
    return at / np.linalg.norm(at)


def test_a_function_of_symbols_computes_with_values_too() -> None:
    x, p = POSES[0], mf.Point3(position=[1, 2, 3])
    np.testing.assert_allclose(seen.function(x, p), seen().residual(x, p), atol=1e-15)
    np.testing.assert_array_equal(mf.functions.log(x), x.log())
    with pytest.raises(TypeError, match="is no function"):

        @mf.factor
        def wrong(x: mf.Se3) -> Any:
            return x.translation()  # type: ignore[operator]

        wrong()


@pytest.mark.parametrize("of", ["differences", "jax"])
def test_a_batch_has_the_fields_of_its_variables(of: str) -> None:
    norm: Any = np.linalg.norm
    if of == "jax":
        pytest.importorskip("jax")
        import jax.numpy as jnp

        norm = jnp.linalg.norm

    @mf.batch(rows=2, jacobian=of)
    def ranges(x: mf.Se3, y: mf.Se2, p: mf.Point3, measured: Any) -> Any:
        both = [norm(x.translation - p.position, axis=1) - measured, y.angle + (y[:, 3:] * 2)[:, 0]]
        return jnp.stack(both, axis=1) if of == "jax" else np.stack(both, axis=1)

    x, y, p = POSES[0], mf.Se2(translation=[1, 2], angle=0.5), mf.Point3(position=[1, 2, 3])
    residual, jacobians = ranges(measured=2.0).linearize(x, y, p)
    np.testing.assert_allclose(residual, [float(np.linalg.norm(x.translation - p.position)) - 2, 2.5])
    np.testing.assert_allclose(jacobians[1][1], [2 * np.cos(0.5), -2 * np.sin(0.5), 1], atol=1e-6)


def test_values_are_constants_of_a_batch() -> None:
    @mf.batch(rows=1)
    def apart_from(x: mf.Se3, anchor: Any) -> Any:
        return np.linalg.norm(x.translation - anchor[:, 4:], axis=1)

    assert apart_from(anchor=POSES[1]).residual(POSES[1]) == 0
    graph = mf.Graph()
    graph.add_many(apart_from, np.arange(N)[:, None], {"anchor": POSES})
    assert graph[3].factor.residual(POSES[3]) == 0
