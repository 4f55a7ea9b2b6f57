"""Groups compute with plain numbers: their laws, and the errors of wrong arguments."""

from __future__ import annotations

import itertools
import json
import math
import operator
import pickle
from typing import Any

import manifactor as mf
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from manifactor.variables import BY_TYPE

GROUPS: list[type[Any]] = [mf.So2, mf.So3, mf.Se2, mf.Se3, mf.Sim3]
#: Dimension of the space that a group acts on.
SPACE = {mf.So2: 2, mf.So3: 3, mf.Se2: 2, mf.Se3: 3, mf.Sim3: 3}
ANGLE = st.floats(-3.0, 3.0)
METRES = st.floats(-100.0, 100.0)


@st.composite
def tangents(draw: st.DrawFn, of: type[Any]) -> np.ndarray:
    """Tangent vectors with rotations of less than half a turn."""
    xi = np.array([draw(ANGLE if name[0] in "rtl" else METRES) for name in of.TANGENT])
    turn = xi[:3] if of in (mf.So3, mf.Se3, mf.Sim3) else xi[:0]
    turn *= min(1.0, 3.0 / max(float(np.linalg.norm(turn)), 1e-300))
    return xi


def close(a: Any, b: Any, tolerance: float = 1e-9) -> None:
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def same(x: Any, y: Any, tolerance: float = 1e-8) -> None:
    assert type(x) is type(y)
    close(x.matrix(), y.matrix(), tolerance)


for_groups = pytest.mark.parametrize("of", GROUPS, ids=lambda of: of.TYPE)


@for_groups
@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_a_group_has_the_laws_of_one(of: type[Any], data: st.DataObject) -> None:
    a, b, c = (data.draw(tangents(of)) for _ in range(3))
    x, y, z = of.exp(a), of.exp(b), of.exp(c)
    assert type(x) is of
    close(x.log(), a)
    same((x * y) * z, x * (y * z))
    same(x * x.inverse(), of.identity())
    same(x.inverse() @ x, of.identity())
    same(x * of.identity(), x, 0.0)
    same(x.between(y), x.inverse() * y)
    same(x.retract(x.local(y)), y)
    close(of.identity().log(), 0 * a, 0.0)
    close((x * y).matrix(), x.matrix() @ y.matrix(), 1e-8)
    close(x.inverse().matrix(), np.linalg.inv(x.matrix()), 1e-8)
    same(of.from_matrix(x.matrix()), x)
    same(x.interpolate(y, 0), x, 0.0)
    same(x.interpolate(y, 1), y)
    half = x.interpolate(y, 0.5)
    close(half.local(y), x.local(half), 1e-7)


@for_groups
@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_a_group_acts_like_its_matrix(of: type[Any], data: st.DataObject) -> None:
    x, n = of.exp(data.draw(tangents(of))), SPACE[of]
    points = np.array(data.draw(st.lists(st.lists(METRES, min_size=n, max_size=n), min_size=1, max_size=5)))
    matrix = x.matrix()
    translation = matrix[:n, n] if len(matrix) > n else 0.0
    expected = points @ matrix[:n, :n].T + translation
    close(x @ points, expected)
    close(x * points, expected)
    close(x @ points[0], expected[0])
    close(x @ list(points[0]), expected[0])
    close(x @ np.asfortranarray(points), expected)
    close(x.inverse() @ (x @ points), points)
    point = {2: mf.Point2, 3: mf.Point3}[n](position=points[0])
    close(x @ point, expected[0])


@for_groups
@given(data=st.data())
@settings(max_examples=30, deadline=None)
def test_an_array_computes_like_a_loop(of: type[Any], data: st.DataObject) -> None:
    n = data.draw(st.integers(1, 4))
    a, b = (np.array([data.draw(tangents(of)) for _ in range(n)]) for _ in range(2))
    p = np.array([[data.draw(METRES) for _ in range(SPACE[of])] for _ in range(n)])
    xs, ys = of.exp(a), of.exp(b)
    assert type(xs) is mf.ValueArray and len(xs) == n and list(xs) == [of.exp(xi) for xi in a]
    assert xs * ys == mf.ValueArray([x * y for x, y in zip(xs, ys, strict=True)])
    assert xs * ys[0] == mf.ValueArray([x * ys[0] for x in xs])
    assert ys[0] @ xs == mf.ValueArray([ys[0] @ x for x in xs])
    assert xs.inverse() == mf.ValueArray([x.inverse() for x in xs])
    assert xs.between(ys) == mf.ValueArray([x.between(y) for x, y in zip(xs, ys, strict=True)])
    assert ys[0].between(xs) == mf.ValueArray([ys[0].between(x) for x in xs])
    assert xs.retract(b) == mf.ValueArray([x.retract(d) for x, d in zip(xs, b, strict=True)])
    assert xs.interpolate(ys, 0.25) == mf.ValueArray([x.interpolate(y, 0.25) for x, y in zip(xs, ys, strict=True)])
    t = np.linspace(0, 1, n)
    assert xs.interpolate(ys, t)[n - 1] == xs[n - 1].interpolate(ys[n - 1], t[n - 1])
    assert xs[0].interpolate(ys[0], t) == mf.ValueArray([xs[0].interpolate(ys[0], s) for s in t])
    assert of.from_matrix(xs.matrix()) == mf.ValueArray([of.from_matrix(x.matrix()) for x in xs])
    close(xs.log(), [x.log() for x in xs], 0.0)
    close(xs.local(ys), [x.local(y) for x, y in zip(xs, ys, strict=True)], 0.0)
    close(xs.matrix(), [x.matrix() for x in xs], 0.0)
    close(xs @ p, [x @ q for x, q in zip(xs, p, strict=True)], 0.0)
    close(xs @ p[0], [x @ p[0] for x in xs], 0.0)


def test_odometry_is_a_product() -> None:
    steps = mf.Se3.exp(np.tile([0, 0, 2 * math.pi / 100, 1, 0, 0], (100, 1)))
    poses = list(itertools.accumulate(steps, operator.mul, initial=mf.Se3.identity()))
    same(poses[100], poses[0])
    radius = 100 / (2 * math.pi)
    close(poses[50].translation, [0, 2 * radius, 0])


def test_long_products_stay_rotations() -> None:
    step = mf.So3.exp([0.1, -0.2, 0.3])
    x = mf.So3.identity()
    for _ in range(10_000):
        x = x * step
    assert abs(np.linalg.norm(x.rotation) - 1) < 1e-15
    assert abs(np.linalg.det(x.matrix()) - 1) < 1e-14


def test_the_quaternion_is_x_y_z_w() -> None:
    quarter = mf.So3.exp([0, 0, math.pi / 2])
    close(quarter.rotation, [0, 0, math.sqrt(0.5), math.sqrt(0.5)])
    close(quarter @ [1, 0, 0], [0, 1, 0])
    close(mf.So2.exp(math.pi / 2) @ [1, 0], [0, 1])


def test_the_tangent_of_a_pose_has_the_rotation_first_in_space_and_last_in_the_plane() -> None:
    close(mf.Se3.exp([0, 0, 0, 1, 2, 3]).translation, [1, 2, 3])
    close(mf.Se2.exp([1, 2, 0]).translation, [1, 2])
    assert mf.Se2.exp([0, 0, 0.5]).angle == 0.5


@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_rotations_agree_with_scipy(data: st.DataObject) -> None:
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    a, b = data.draw(tangents(mf.So3)), data.draw(tangents(mf.So3))
    x, y = mf.So3.exp(a), mf.So3.exp(b)
    r, s = rotation.from_rotvec(a), rotation.from_rotvec(b)
    close(x.matrix(), r.as_matrix())
    close((x * y).matrix(), (r * s).as_matrix())
    close(mf.So3.from_scipy(r).matrix(), x.matrix())
    close(x.to_scipy().as_matrix(), x.matrix())
    several = rotation.from_rotvec([a, b])
    xs = mf.So3.from_scipy(several)
    assert type(xs) is mf.ValueArray and len(xs) == 2
    close(xs.to_scipy().as_matrix(), several.as_matrix())


def test_only_rotations_in_space_become_those_of_scipy() -> None:
    pytest.importorskip("scipy")
    with pytest.raises(mf.ArgumentError, match="expected rotations of the type `so3`, got `se3`"):
        mf.ValueArray([mf.Se3.identity()]).to_scipy()


VALUES: list[Any] = [
    mf.So2(angle=0.1),
    mf.So3.exp([0.1, 0.2, 0.3]),
    mf.Se2(translation=[1 / 3, -0.0], angle=1e-300),
    mf.Se3.exp([0.1, 0.2, 0.3, 1, 2, 3]),
    mf.Sim3.exp([0.1, 0.2, 0.3, 1, 2, 3, 0.2]),
    mf.Point1(position=[0.1]),
    mf.Point2(position=[0.1, 1 / 3]),
    mf.Point3(position=[0, 1, 2]),
    mf.S2(direction=[1, 2, 3]),
    mf.Plane(normal=[0, 0.6, 0.8], offset=0.5),
    mf.DualQuadric(translation=[0, 1, 2], rotation=[0, 0, 0.6, 0.8], semi_axes=[0.1, 0.2, 0.3]),
    mf.Twist(angular=[0, 1, 2], linear=[3, 4, 5]),
    mf.Velocity(linear=[3, 4, 5]),
    mf.ImuBias(gyroscope=[0, 1, 2], accelerometer=[3, 4, 5]),
    mf.BalCamera(translation=[0, 1, 2], rotation=[0, 0, 0.6, 0.8], focal_length=500, k1=0.1, k2=0),
    mf.Pinhole(fx=500, fy=501, cx=320, cy=240, width=640, height=480),
    mf.Radial(f=500, cx=320, cy=240, width=640, height=480, distortion=[0.1, 0]),
    mf.RadialTangential(fx=500, fy=501, cx=320, cy=240, width=640, height=480, distortion=[0.1, 0, 0.01, 0]),
    mf.KannalaBrandt(fx=300, fy=301, cx=320, cy=240, width=640, height=480, distortion=[0.1, 0, 0.01, 0]),
]


@pytest.mark.parametrize("x", VALUES, ids=lambda x: x.type)
def test_texts_and_bytes_give_a_value_back(x: Any) -> None:
    names = {of.__name__: of for of in BY_TYPE.values()}
    assert eval(repr(x), names) == x  # noqa: S307
    assert type(x).from_dict(json.loads(json.dumps(x.to_dict()))) == x
    again = mf.Variable.from_dict(x.to_dict())
    assert again == x and type(again) is type(x) and hash(again) == hash(x)
    fields = {name: field for name, field in x.to_dict().items() if name != "type"}
    assert type(x).from_dict(fields) == x
    array = mf.ValueArray([x, x])
    assert pickle.loads(pickle.dumps(array)) == array and array[1] == x
    assert type(x).from_fields(array.fields()) == array
    moved = x.retract(np.full(len(x.TANGENT), 0.1))
    assert x != moved and len({x, moved, again}) == 2
    close(x.local(moved), 0.1)
    close(x.local(x.interpolate(moved, 0.5)), 0.05)


def test_every_type_of_values_is_tested() -> None:
    assert {x.type for x in VALUES} == set(BY_TYPE)


def test_equal_numbers_have_equal_hashes() -> None:
    a, b = mf.Point2(position=[0.0, 1]), mf.Point2(position=[-0.0, 1])
    assert a == b and hash(a) == hash(b)


def test_functions_of_formulas_compute() -> None:
    q = mf.DualQuadric(translation=[0, 1, 2], rotation=[0, 0, 0, 1], semi_axes=[0.1, 0.3, 0.2])
    close(q.major_axis, [0, 1, 0])
    close(q.centroid, q.translation)
    assert q.pose == mf.Se3(translation=[0, 1, 2], rotation=[0, 0, 0, 1])
    assert q.extent([0, 0, 1]) == pytest.approx(0.2)
    x = mf.Se3.exp([0.1, 0.2, 0.3, 1, 2, 3])
    close(x.position, x.translation)
    assert mf.Se2(translation=[1, 2], angle=0.5).rotation == mf.So2(angle=0.5)
    assert mf.Plane(normal=[0, 0, 1], offset=0.5).height([1, 2, 3]) == 2.5
    p, q2 = mf.Point3(position=[3, 0, 4]), mf.Point3(position=[0, 0, 4])
    assert p.norm == 5 and p @ q2 == 16 and p.x == 3
    close(p - q2, [3, 0, 0])
    close(np.array([3.0, 0, 0]) + q2, [3, 0, 4])
    close(2 * p, [6, 0, 8])
    close(-p / 2, [-1.5, 0, -2])
    assert np.linalg.norm(p) == 5
    close(np.stack([p, q2]), [[3, 0, 4], [0, 0, 4]])
    close(np.arange(3.0) @ p, 8)


NAN = np.diag([np.nan, 1, 1, 1])
SHEARED = np.eye(4) + 0.1 * np.eye(4, k=1)
WRONG: dict[str, tuple[Any, str]] = {
    "a scaled matrix": (lambda: mf.So3.from_matrix(2 * np.eye(3)), r"matrix: expected a rotation R with RᵀR = 1.*numpy.linalg.svd"),
    "a sheared matrix": (lambda: mf.Se3.from_matrix(SHEARED), r"RᵀR"),
    "a reflection": (lambda: mf.So3.from_matrix(np.diag([1, 1, -1])), "got a reflection, of determinant -1.*right-handed"),
    "a transposed pose": (lambda: mf.Se2.from_matrix([[1, 0, 0], [0, 1, 0], [5, 6, 1]]), "in the last row.* got 5 in column 0.*transpose"),
    "no number": (lambda: mf.Se3.from_matrix(NAN), "matrix: expected finite numbers, got NaN"),
    "the second of two": (lambda: mf.Se3.from_matrix(np.stack([np.eye(4), -np.eye(4)])), r"matrix\[1\]: "),
    "a small matrix": (lambda: mf.Se3.from_matrix(np.eye(3)), r"matrix: expected an array of shape \(4, 4\), got \(3, 3\)"),
    "no matrix": (lambda: mf.So3.from_matrix([1, 2, 3]), r"expected an array of shape \(3, 3\), got \(3,\)"),
    "too many axes": (lambda: mf.So2.from_matrix(np.zeros((1, 1, 2, 2))), r"expected an array of shape \(2, 2\)"),
    "texts": (lambda: mf.So2.from_matrix([["a", "b"], ["c", "d"]]), "expected an array of real numbers"),
    "complex numbers": (lambda: mf.So2.from_matrix(np.eye(2) * 1j), "expected an array of real numbers"),
    "truth values": (lambda: mf.So3.exp(np.zeros(3, bool)), "expected an array of real numbers"),
    "a short tangent": (lambda: mf.Se3.exp([1, 2, 3]), r"delta: expected an array of shape \(6,\) or \(n, 6\), got \(3,\)"),
    "a wide tangent": (lambda: mf.Se3.exp(np.zeros((4, 7))), r"expected an array of shape \(6,\) or \(n, 6\), got \(4, 7\)"),
    "a ragged tangent": (lambda: mf.Se3.exp([[1], [2, 3]]), "expected an array of numbers"),
    "an infinite tangent": (lambda: mf.Se3.exp([0, 0, 0, np.inf, 0, 0]), "expected finite numbers, got inf"),
    "an overflow": (lambda: mf.Se3.exp([1e200] * 6), "not finite"),
    "a wide point": (lambda: mf.Se3.identity() @ [1, 2], r"`\*` does not take se3 and an array of shape \(2,\).*act\(x: se3|\*\(x: se3"),
    "another group": (lambda: mf.Se3.identity() * mf.Se2.identity(), r"`\*` does not take se3 and se2"),
    "a number": (lambda: mf.Se3.identity() * 2, r"`\*` does not take se3 and a number"),
    "a sum of poses": (lambda: mf.Se3.identity() + mf.Se3.identity(), r"`\+` does not take se3 and se3"),
    "points that are NaN": (lambda: mf.Se3.identity() @ [np.nan, 0, 0], "expected finite numbers, got NaN"),
    "between of a text": (lambda: mf.Se3.identity().between("x"), "between"),  # type: ignore[call-overload]
    "interpolation to another type": (lambda: mf.Se3.identity().interpolate(mf.Se2.identity(), 0.5), "expected a se3, got a se2"),  # type: ignore[call-overload]
    "fractions by rows and columns": (lambda: mf.Se3.identity().interpolate(mf.Se3.identity(), np.zeros((2, 2))), r"t: .* shape \(n,\), got one of shape \(2, 2\)"),
    "a fraction that is NaN": (lambda: mf.Se3.identity().interpolate(mf.Se3.identity(), math.nan), "expected finite numbers"),
    "the dict of another type": (lambda: mf.Se3.from_dict(mf.Se2.identity().to_dict()), "type: expected `se3`, got 'se2'"),
    "no type": (lambda: mf.Variable.from_dict({"position": [1]}), "unknown variable"),
    "a number for a type": (lambda: mf.Variable.from_dict({"type": 3}), "unknown variable `3`"),
    "a field that is missing": (lambda: mf.Se2.from_dict({"angle": 1}), "missing field `translation`"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_argument_is_an_error_that_names_it(name: str) -> None:
    call, message = WRONG[name]
    with pytest.raises(mf.ArgumentError, match=message):
        call()


def test_other_operands_are_type_errors() -> None:
    for wrong in (None, {}, object()):
        with pytest.raises(TypeError, match="unsupported operand"):
            mf.Se3.identity() * wrong
        with pytest.raises(TypeError, match="unsupported operand"):
            wrong @ mf.Se3.identity()


def test_rounding_errors_of_a_matrix_are_removed() -> None:
    x = mf.Se3.exp([0.1, 0.2, 0.3, 1, 2, 3])
    rounded = mf.Se3.from_matrix(np.round(x.matrix(), 5))
    assert abs(np.linalg.norm(rounded.rotation) - 1) < 1e-15
    same(rounded, x, 1e-4)
    same(mf.Se3.from_matrix(x.matrix().astype(np.float32)), x, 1e-6)
