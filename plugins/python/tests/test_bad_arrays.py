"""Any array gives an exception that names the argument, never a crash."""

from __future__ import annotations

from typing import Any

import manifactor as mf
import numpy as np
import pytest

N = 4
KEYS = np.stack([np.arange(N), np.arange(N) + 1], axis=1)
GOOD = {"translation": np.zeros((N, 3)), "rotation": np.tile([0.0, 0, 0, 1], (N, 1))}
HUGE = np.broadcast_to(np.zeros(3), (1 << 40, 3))


def add(relative: dict[str, Any] = GOOD, keys: Any = KEYS, **options: Any) -> mf.Graph:
    graph = mf.Graph()
    try:
        graph.add_many(mf.between_se3, keys, {"relative": relative}, **options)
    finally:
        # all factors are added or none
        assert len(graph) in (0, N)
    return graph


BAD_TRANSLATIONS: dict[str, tuple[Any, str]] = {
    "too few rows": (np.zeros((N - 1, 3)), "relative.translation: expected an array of 4 rows, one for each, got 3 rows"),
    "no axis": (np.float64(1), "relative.translation"),
    "too narrow": (np.zeros((N, 2)), "relative.translation, row 0"),
    "too wide": (np.zeros((N, 4)), "relative.translation, row 0"),
    "too many axes": (np.zeros((N, 3, 1)), "relative.translation"),
    "no columns": (np.zeros((N, 0)), "relative.translation, row 0"),
    "not a number": (np.full((N, 3), np.nan), r"relative.translation: expected finite numbers, got NaN at \[0, 0\]"),
    "infinite": (np.array([[0, 0, 0]] * 3 + [[0, np.inf, 0]]), r"relative.translation: .* got inf at \[3, 1\]"),
    "complex": (np.zeros((N, 3), complex), "relative.translation: expected an array of real numbers, got one of the type complex128"),
    "objects": (np.full((N, 3), None), "relative.translation: expected an array of real numbers"),
    "texts": (np.full((N, 3), "a"), "relative.translation: expected an array of real numbers"),
    "dates": (np.zeros((N, 3), "datetime64[s]"), "relative.translation: expected an array of real numbers"),
    "truth values": (np.zeros((N, 3), bool), "relative.translation: expected an array of real numbers, got one of the type bool"),
    "huge": (HUGE, "relative.translation: expected an array of 4 rows"),
    "a text": ("abc", "relative.translation"),
}


@pytest.mark.parametrize("name", BAD_TRANSLATIONS)
def test_fields(name: str) -> None:
    array, message = BAD_TRANSLATIONS[name]
    with pytest.raises(mf.ArgumentError, match=message):
        add({**GOOD, "translation": array})


COUNTED = np.arange(3.0 * N).reshape(N, 3)


@pytest.mark.parametrize(
    "array",
    [
        COUNTED.copy(),
        np.asfortranarray(COUNTED),
        COUNTED.T.copy().T,
        np.repeat(np.repeat(COUNTED, 2, axis=0), 2, axis=1)[::2, ::2],
        COUNTED[::-1, ::-1].copy()[::-1, ::-1],
        COUNTED.astype(np.float32),
        COUNTED.astype(np.int8),
        COUNTED.astype(np.uint64),
        COUNTED.astype(">f8"),
        np.ma.masked_array(COUNTED, False),
        np.frombuffer(COUNTED.tobytes()).reshape(N, 3),
        # behind one byte, so that no number is aligned
        np.frombuffer(b"0" + COUNTED.tobytes(), offset=1).reshape(N, 3),
    ],
    ids=lambda array: f"{array.dtype} {array.strides} {array.flags.aligned}",
)
def test_any_layout_will_do(array: np.ndarray[Any, Any]) -> None:
    array.flags.writeable = False
    graph = add({**GOOD, "translation": array})
    assert [graph[row].to_dict()["factor"]["relative"]["translation"] for row in range(N)] == COUNTED.tolist()
    assert mf.Point3(position=array[1]).position.tolist() == COUNTED[1].tolist()


def test_a_quaternion_that_is_none_is_named_with_its_row() -> None:
    rotation = GOOD["rotation"].copy()
    rotation[2] = 0
    with pytest.raises(mf.ArgumentError, match="relative.rotation, row 2"):
        add({**GOOD, "rotation": rotation})


@pytest.mark.parametrize(
    ("noise", "message"),
    [
        ({"sigmas": np.ones((N, 6))}, None),
        ({"sigmas": np.ones((N, 0))}, "noise.sigmas: expected a number for each row of the residual, got none"),
        ({"information": np.ones((N, 0, 0))}, "noise.information: expected a number for each row"),
        ({"sigmas": np.ones((N - 1, 6))}, "noise.sigmas: expected an array of 4 rows, one for each, got 3 rows"),
        ({"sigmas": np.zeros((N, 6))}, "noise.sigmas, row 0: .* above zero, got 0"),
        ({"sigmas": np.full((N, 6), np.nan)}, "noise.sigmas: expected finite numbers"),
        ({"information": np.ones((N, 6, 5))}, "noise.information: expected a square matrix, got 6 rows and 5 columns"),
        ({"covariance": -np.tile(np.eye(6), (N, 1, 1))}, "noise.covariance, row 0.*positive definite"),
        ({"covariance": np.broadcast_to(np.eye(6), (1 << 40, 6, 6))}, "noise.covariance: expected an array of 4 rows"),
        ({"sigma": np.ones(N), "sigmas": np.ones((N, 6))}, "noise: expected a dict of one of"),
        ({"spread": np.ones(N)}, "noise: expected a dict of one of"),
        (-1.0, "noise: a standard deviation must be a finite number above zero, got -1"),
    ],
)
def test_noise(noise: Any, message: str | None) -> None:
    if message is None:
        assert len(add(noise=noise)) == N
    else:
        with pytest.raises(mf.ArgumentError, match=message):
            add(noise=noise)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (KEYS.astype(float), "keys: expected texts or whole numbers"),
        (np.zeros((N, 2, 2), int), "keys: expected an array of one or two axes, got 3"),
        ([("a", "b"), ("c",)], "keys: row 1 has 1 keys, those before it 2"),
        ([("a", 3.5)], "keys: expected a key, or several"),
        (7, "keys: expected texts by rows"),
    ],
)
def test_keys(keys: Any, message: str) -> None:
    with pytest.raises(mf.ArgumentError, match=message):
        add(keys=keys)


def test_a_prefix_too_many() -> None:
    with pytest.raises(mf.ArgumentError, match="prefix: expected a text, or 2: one for each column of `keys`, got 3"):
        add(prefix=["a", "b", "c"])


def test_single_values() -> None:
    with pytest.raises(mf.ArgumentError, match="se3: translation: expected 3 numbers, got 2"):
        mf.Se3(translation=[0, 0], rotation=[0, 0, 0, 1])
    with pytest.raises(mf.ArgumentError, match=r"translation: expected finite numbers, got NaN at \[1\]"):
        mf.Se3(translation=np.array([0, np.nan, 0]), rotation=[0, 0, 0, 1])
    with pytest.raises(mf.ArgumentError, match="translation.*`NaN` is not a finite number"):
        mf.Se3(translation=[0, np.nan, 0], rotation=[0, 0, 0, 1])
    x = mf.Point2(position=[0, 0])
    with pytest.raises(mf.ArgumentError, match=r"delta: expected an array of shape \(2,\) or \(n, 2\), got \(3,\)"):
        x.retract(np.zeros(3))
    with pytest.raises(mf.ArgumentError, match="to: expected a point2, got a point1"):
        x.local(mf.Point1(position=[0]))  # type: ignore[arg-type]


def test_what_cannot_be_in_a_document() -> None:
    recursive: list[Any] = []
    recursive.append(recursive)
    cases: list[tuple[Any, str]] = [
        (object(), "position: expected numbers, texts, lists, dicts or arrays, got object"),
        (recursive, "nested more than 64 levels deep"),
        ({1: 2}, "position: expected names as keys, got 1"),
        ("here", 'position: expected an array, found the text "here"'),
        (10**400, "position: expected a number of at most 64 bits"),
    ]
    for value, message in cases:
        with pytest.raises(mf.ArgumentError, match=message):
            mf.Point2(position=value)


def test_a_mistake_says_what_to_do() -> None:
    with pytest.raises(mf.ArgumentError) as raised:
        mf.bounding_box(box=[0, 0, 1, 1], camera={"fx": 1, "fy": 1, "cx": 0, "cy": 0, "width": 9, "hight": 9})  # type: ignore[typeddict-unknown-key, typeddict-item]
    places = {mistake.place: mistake for mistake in raised.value.mistakes}
    assert places["camera.hight"].help is not None and "did you mean `height`?" in places["camera.hight"].help
    with pytest.raises(mf.ArgumentError, match="unknown factor `betwen_se3`.*did you mean `between_se3`"):
        mf.Factor("betwen_se3")


def test_whole_numbers_above_the_range_of_integers_keep_their_size() -> None:
    for value in (2**64 - 1, 2**63, 2**63 - 1):
        array = np.array([value], dtype=np.uint64)
        assert mf.Point1(position=array).position[0] == float(value)
