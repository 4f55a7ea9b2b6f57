"""Factors that are written in Python and run as formulas."""

from __future__ import annotations

import fractions
import inspect
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import manifactor as mf
import manifactor.functions as fn
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

small = arrays.arrays(float, 6, elements=st.floats(-1.5, 1.5))


@mf.factor
def stands(q: mf.DualQuadric, up: Any) -> Any:
    """A bottle stands."""
    return 1 - abs(q.major_axis @ up)


def quadric(at: Any = (0.3, -0.2, 0.5, 0, 0, 0)) -> mf.DualQuadric:
    pose = mf.Se3(translation=[0, 0, 0], rotation=[0, 0, 0, 1]).retract(at)
    return mf.DualQuadric(translation=pose.translation, rotation=pose.rotation, semi_axes=[0.1, 0.2, 0.4])


def test_a_factor_is_its_formula() -> None:
    fields = stands().to_dict()
    assert fields["variables"] == {"q": "dual_quadric"}
    assert fields["residual"] == ["1.0 - abs(dot(major_axis(q), up))"]
    assert stands(up=(0, 1, 0)).to_dict()["up"] == [0, 1, 0]
    assert repr(stands) == "<factor stands(q: DualQuadric, up)>" and stands.__doc__ == "A bottle stands."


@given(small)
def test_it_says_what_the_built_in_factor_says(at: np.ndarray[Any, Any]) -> None:
    q = quadric(at)
    (ours, (by_ours,)), (built_in, (by_built_in,)) = stands().linearize(q), mf.vertical_orientation().linearize(q)
    np.testing.assert_allclose(ours, built_in, atol=1e-14)
    np.testing.assert_allclose(by_ours, by_built_in, atol=1e-14)


@mf.factor
def everything(x: mf.Se3, p: mf.Point3, gain: Any, offset: Any, body: Any = (0.1, 0.2, 0.3)) -> Any:
    seen = x.inverse() * (p + body)
    far = np.linalg.norm(seen)
    u, v, w = seen
    flat = np.where(far > 2, far, 2 + (far - 2) * gain)
    return [
        seen / far - offset,
        np.sin(u) * np.cos(v) - np.exp(-w) + np.sqrt(far),
        flat ** 2 / 3,
        np.arctan2(u, v),
        -np.minimum(u, v) + np.maximum(u, 0.5),
        fn.log(x.rotation),
        np.cross(seen, offset),
        mf.where((u > 0) & (v > 0) | ~(w >= 0), 1.0, far),
        seen[0] + p[-1],
    ]


def by_numpy(x: mf.Se3, p: mf.Point3, gain: float, offset: Sequence[float], body: Sequence[float]) -> Any:
    """The camera factor in NumPy."""
    rotation = mf.rotations(x.rotation[None])[0]
    seen = rotation.T @ (p.position + body - x.translation)
    far = np.linalg.norm(seen)
    u, v, w = seen
    flat = far if far > 2 else 2 + (far - 2) * gain
    xyz, c = x.rotation[:3], x.rotation[3]
    log = xyz * (2 * np.arctan2(np.linalg.norm(xyz), abs(c)) / np.linalg.norm(xyz)) * (1 if c >= 0 else -1)
    rows = [seen / far - offset, np.sin(u) * np.cos(v) - np.exp(-w) + np.sqrt(far), flat**2 / 3, np.arctan2(u, v)]
    rows += [-min(u, v) + max(u, 0.5), log, np.cross(seen, offset)]
    rows += [1.0 if (u > 0 and v > 0) or not w >= 0 else far, seen[0] + p.position[-1]]
    return np.concatenate([np.ravel(row) for row in rows])


@given(small, arrays.arrays(float, 3, elements=st.floats(-3, 3)), st.floats(-2, 2))
def test_a_traced_factor_says_what_numpy_says(at: Any, point: Any, gain: float) -> None:
    assume(0.1 < np.linalg.norm(at[:3]) < 3)
    x = mf.Se3(translation=[0, 0, 0], rotation=[0, 0, 0, 1]).retract(at)
    p = mf.Point3(position=point)
    factor = everything(gain=gain, offset=[0.5, 0.0, -1.0])
    expected = by_numpy(x, p, gain, [0.5, 0.0, -1.0], [0.1, 0.2, 0.3])
    assume(np.linalg.norm(point + [0.1, 0.2, 0.3] - x.translation) > 0.1)
    np.testing.assert_allclose(factor.residual(x, p), expected, rtol=1e-9, atol=1e-9)


def test_more_than_nine_rows_are_solved() -> None:
    x, p = mf.Se3(translation=[0, 0, 0], rotation=[0, 0, 0, 1]), mf.Point3(position=[1, 2, 0.5])
    factor = everything(gain=0.5, offset=[0.5, 0.0, -1.0])
    rows = len(factor.residual(x, p))
    assert rows == 15
    graph = mf.Graph()
    graph.add(["x", "p"], factor, noise=mf.Noise(sigmas=np.linspace(0.1, 1, rows)), loss=mf.huber())
    graph.add("x", mf.prior_se3(value=x), noise=0.1)
    graph.add("p", mf.prior_point3(value=p), noise=0.1)
    solution = mf.solve(graph, mf.Values({"x": x, "p": p}))
    assert solution.converged and solution.residual(0).shape == (15,) and solution.cost < solution.initial_cost


def test_the_jacobian_holds() -> None:
    check = mf.check_factor(stands)
    assert check and check.holds
    assert "Jacobian" in repr(check) and check.report["defined"] > 100
    check = mf.check_factor(everything, gain=0.5, offset=[0.5, 0.0, -1.0])
    assert check.text

    @mf.factor
    def infinite(p: mf.Point1) -> Any:
        return np.sqrt(p - 1e9)

    assert not mf.check_factor(infinite())


def test_what_is_used_twice_is_computed_once() -> None:
    @mf.factor
    def doubled(p: mf.Point1) -> Any:
        x: Any = p
        for _ in range(100):
            x = np.sin(x) + x
        return x

    fields = doubled().to_dict()
    assert len(str(fields)) < 10_000 and len(fields["define"]) < 120
    at = 0.3
    for _ in range(100):
        at = np.sin(at) + at
    assert doubled().residual(mf.Point1(position=[0.3])) == pytest.approx(at)


def test_a_long_sum_is_no_problem() -> None:
    @mf.factor
    def long(p: mf.Point2) -> Any:
        return sum((p[0] - i) * (p[1] + i) for i in range(500))

    expected = sum((0.5 - i) * (2 + i) for i in range(500))
    assert long().residual(mf.Point2(position=[0.5, 2])) == pytest.approx(expected)


def test_constants_of_many_factors() -> None:
    @mf.factor
    def measured(x: mf.Se2, p: mf.Point2, distance: Any, lever: Any) -> Any:
        return np.linalg.norm(p - x * lever) - distance

    distances, levers = np.array([1.0, 2.0]), np.array([[0.1, 0], [0, 0.2]])
    many, one = mf.Graph(), mf.Graph()
    keys = np.array([[0, 1], [1, 1]])
    many.add_many(measured, keys, {"distance": distances, "lever": levers}, prefix=["x", "p"])
    for (x, p), d, lever in zip(keys, distances, levers, strict=True):
        one.add([f"x{x}", f"p{p}"], measured(distance=d, lever=lever))
    assert [many[i] for i in range(2)] == [one[i] for i in range(2)]
    with pytest.raises(TypeError, match="measured has no constant `lewer`: there are distance, lever"):
        measured(distance=1.0, lewer=[0, 0])
    with pytest.raises(TypeError, match="measured: missing the constant `lever`"):
        measured(distance=1.0)


def test_a_pose_as_a_constant() -> None:
    @mf.factor
    def at_anchor(x: mf.Se3, anchor: Any) -> Any:
        return fn.log(fn.between(anchor, x))

    anchor = mf.Se3(translation=[1, 2, 3], rotation=[0, 0, 0.6, 0.8])
    x = mf.Se3(translation=[0, 1, 0], rotation=quadric().rotation)
    np.testing.assert_allclose(at_anchor(anchor=anchor).residual(x), mf.prior_se3(value=anchor).residual(x), atol=1e-12)


def test_a_domain() -> None:
    @mf.factor
    def in_front(x: mf.Se3, p: mf.Point3) -> Any:
        seen = x.inverse * p  # the attribute is a symbol too
        mf.require(seen[2] > 0.1)
        return fn.project(seen)

    assert in_front().to_dict()["domain"]
    graph = mf.Graph()
    graph.add(["x", "p"], in_front())
    graph.add("x", mf.prior_se3(value=mf.Se3(translation=[0, 0, 0], rotation=[0, 0, 0, 1])))
    graph.add("p", mf.prior_point3(value=mf.Point3(position=[0, 0, -5])))
    values = mf.Values({"x": mf.Se3(translation=[0, 0, 0], rotation=[0, 0, 0, 1]), "p": mf.Point3(position=[0, 0, -5])})
    assert mf.solve(graph, values).outcome["inactive"] == 1


def line_of(error: BaseException) -> str:
    """Returns the last line of this file in a traceback."""
    trace, line = error.__traceback__, 0
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == __file__:
            line = trace.tb_lineno
        trace = trace.tb_next
    return Path(__file__).read_text().splitlines()[line - 1].strip()


MISTAKES: list[tuple[Any, type[Exception], str, str]] = []


F = TypeVar("F")


def mistake(error: type[Exception], message: str, line: str) -> Callable[[F], F]:
    def enter(function: F) -> F:
        MISTAKES.append((function, error, message, line))
        return function

    return enter


@mistake(mf.TraceError, r"write mf.where\(condition, a, b\)", "if q.centroid[2] > 0:")
def branches(q: mf.DualQuadric) -> Any:
    if q.centroid[2] > 0:
        return q.centroid
    return -q.centroid


@mistake(mf.TraceError, "`dot` does not take .vector3, vector2.*there is dot", "return q.centroid @ (1, 2)")
def two_and_three(q: mf.DualQuadric) -> Any:
    return q.centroid @ (1, 2)


@mistake(AttributeError, "a dual_quadric has no `axis`.*what takes it: .*major_axis", "return q.axis")
def misspelt(q: mf.DualQuadric) -> Any:
    return q.axis


@mistake(mf.TraceError, r"`\+` is not defined between vector3 and number", "return q.centroid + 1")
def vector_and_number(q: mf.DualQuadric) -> Any:
    return q.centroid + 1


@mistake(mf.TraceError, "numpy's `floor` is no function of formulas", "return np.floor(q.centroid[0])")
def no_ufunc(q: mf.DualQuadric) -> Any:
    return np.floor(q.centroid[0])


@mistake(mf.TraceError, "a variable has no value while a factor is traced", "return np.array([float(q.centroid[0])])")
def a_number_of_it(q: mf.DualQuadric) -> Any:
    return np.array([float(q.centroid[0])])


@mistake(mf.TraceError, "never tested for equality", "return mf.where(q.centroid[0] == 1, 1, 2)")
def equal(q: mf.DualQuadric) -> Any:
    return mf.where(q.centroid[0] == 1, 1, 2)


@pytest.mark.parametrize("case", MISTAKES, ids=lambda case: case[0].__name__)
def test_a_mistake_is_shown_at_its_line(case: tuple[Any, type[Exception], str, str]) -> None:
    function, error, message, line = case
    with pytest.raises(error, match=message) as raised:
        mf.factor(function)()
    assert line_of(raised.value).startswith(line)


def test_mistakes_of_a_function() -> None:
    with pytest.raises(mf.TraceError, match="no argument is a variable.*annotate them"):
        mf.factor(lambda q: q)

    def nothing(p: mf.Point1) -> Any:
        return "text"

    with pytest.raises(mf.TraceError, match=r"test_factors.py:\d+: expected a number, a vector or a list"):
        mf.factor(nothing)()

    def constant(p: mf.Point1) -> Any:
        return [p, 1.0]

    with pytest.raises(mf.ArgumentError, match="this formula is constant") as raised:
        mf.factor(constant)()
    assert "in the factor `constant`" in raised.value.__notes__[0]
    with pytest.raises(mf.TraceError, match="the same arguments wherever it is used"):
        mf.factor(lambda *q: q)


def test_a_formula_is_a_factor_too() -> None:
    formula = mf.expression(variables={"q": "dual_quadric"}, residual=["1 - abs(dot(major_axis(q), up))"])
    np.testing.assert_array_equal(formula.residual(quadric()), stands().residual(quadric()))
    with pytest.raises(mf.ArgumentError) as raised:
        mf.expression(variables={"q": "dual_quadric"}, residual=["1 - abs(dto(major_axis(q), up))"])
    shown = str(raised.value)
    assert "residual[0]: unknown function `dto`\n  1 - abs(dto(major_axis(q), up))\n          ^^^\ndid you mean `dot`?" in shown


def test_the_command_line_runs_what_was_written_in_python(tmp_path: Path) -> None:
    graph, values = mf.Graph(), mf.Values({"q3": quadric()})
    # the key of the examples, which the report uses
    graph.add("q3", stands(up=[0, 0, 1]), noise=0.1)
    graph.add("q3", mf.prior_quadric(value=quadric()), noise=1.0)
    mf.save(tmp_path / "graph.toml", graph, values)
    solution = mf.solve(graph, values)
    done = subprocess.run(
        [sys.executable, "-m", "manifactor", "solve", str(tmp_path / "graph.toml"), "--json"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert f'"final_cost": {solution.cost!r}'[:30] in done.stdout
    checked = subprocess.run(
        [sys.executable, "-m", "manifactor", "check-factor", "--config", str(tmp_path / "graph.toml"), "expression"],
        capture_output=True,
        text=True,
    )
    assert checked.returncode == 0 and checked.stdout.strip() == mf.check_factor(stands(up=[0, 0, 1]), quadric()).text.strip()


def test_functions_of_formulas_are_documented() -> None:
    for name, function in inspect.getmembers(fn, inspect.isfunction):
        if function.__module__ == fn.__name__:
            assert function.__doc__ and "->" in function.__doc__, name
    with pytest.raises(mf.TraceError, match="use numpy's"):
        fn.norm([1, 2, 3])


def test_what_makes_a_factor_is_to_be_called() -> None:
    @mf.factor
    def stands(q: mf.DualQuadric, up: Any) -> Any:
        return 1 - abs(q.major_axis @ up)

    graph = mf.Graph()
    with pytest.raises(TypeError, match=r"factor: expected a factor, got TracedFactor; call it: stands\(…\)"):
        graph.add("q0", stands)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"loss: expected a loss, got function; call it: huber\(…\)"):
        graph.add("q0", stands(), loss=mf.huber)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"loss: expected a loss, got str$"):
        graph.add("q0", stands(), loss="huber")  # type: ignore[arg-type]


TABLE: Any = {1, 2}


def scaled(x: Any, by: float = 1.0) -> Any:
    return x * by


def test_a_formula_is_made_again_if_a_name_has_another_object() -> None:
    global TABLE

    @mf.factor
    def uses(p: mf.Point1) -> Any:
        return scaled(p) * sum(float(item) for item in TABLE)

    values = mf.Values({"p": mf.Point1(position=[1])})

    def residual() -> float:
        graph = mf.Graph()
        graph.add(["p"], uses())
        return float(np.sqrt(2 * graph.cost(values)))

    assert residual() == pytest.approx(3)
    for table, expected in [({5}, 5.0), ((fractions.Fraction(1, 2),), 0.5), (frozenset({7, 8}), 15.0)]:
        TABLE = table
        assert residual() == pytest.approx(expected)
    scaled.__defaults__ = (2.0,)
    try:
        assert residual() == pytest.approx(30)
    finally:
        scaled.__defaults__ = (1.0,)


def test_rotations_are_of_unit_quaternions() -> None:
    with pytest.raises(mf.ArgumentError, match="expected unit quaternions"):
        mf.rotations(np.array([[0.0, 0, 0, 2]]))
