"""Graphs and values, built one by one and in bulk."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import manifactor as mf
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

finite = st.floats(-100, 100, allow_subnormal=False)


def square() -> tuple[mf.Graph, mf.Values]:
    """Four poses in a square, with a loop closure."""
    graph, values = mf.Graph(), mf.Values()
    step = mf.Se2(translation=[1, 0], angle=np.pi / 2)
    for i, at in enumerate([(0, 0, 0.1), (1.1, 0, 1.5), (1, 1.2, 3.1), (-0.1, 1, -1.5)]):
        values[f"x{i}"] = mf.Se2(translation=at[:2], angle=at[2])
    graph.add("x0", mf.prior_se2(value=mf.Se2(translation=[0, 0], angle=0)), noise=0.01)
    for i in range(4):
        graph.add([f"x{i}", f"x{(i + 1) % 4}"], mf.between_se2(relative=step), noise=mf.Noise(sigmas=[0.1, 0.1, 0.02]))
    return graph, values


def test_a_square_closes() -> None:
    graph, values = square()
    solution = mf.solve(graph, values)
    assert solution.converged and solution.cost < 1e-12 < solution.initial_cost
    corner = solution.values["x2"]
    assert isinstance(corner, mf.Se2)
    np.testing.assert_allclose(corner.translation, [1, 1], atol=1e-6)
    assert "converged" in repr(solution) and "<table>" in solution._repr_html_()
    # the graph and its initial values are unchanged
    assert values["x1"].angle == 1.5 and len(graph) == 5


def test_a_solution_has_a_page(tmp_path: Path) -> None:
    graph, values = square()
    solution = mf.solve(graph, values)
    assert solution.initial_values["x1"].angle == values["x1"].angle == 1.5
    page = solution.plot("a square")
    for text in ("<h1>a square</h1>", "4 variables and 5 factors. Converged", "between_se2", '"key":"x2"'):
        assert text in page.html, text
    assert "<iframe" in page._repr_html_()
    page.save_html(tmp_path / "square.html")
    assert (tmp_path / "square.html").read_text(encoding="utf-8") == page.html
    with pytest.raises(mf.ManifactorError, match="exists already"):
        page.save_html(tmp_path / "square.html")
    # a solution that was pickled has the same page
    again = pickle.loads(pickle.dumps(solution))
    assert again.plot("a square").html == page.html and again.initial_values["x1"].angle == 1.5


def test_many_at_once_are_the_same_as_one_by_one() -> None:
    rng = np.random.default_rng(1)
    n = 50
    translation, angle = rng.normal(size=(n, 2)), rng.normal(size=n)
    sigmas = rng.uniform(0.1, 1, size=(n, 3))
    one, many = mf.Graph(), mf.Graph()
    for i in range(n):
        relative = mf.Se2(translation=translation[i], angle=angle[i])
        noise = mf.Noise(sigmas=sigmas[i])
        one.add([f"x{i}", f"x{i + 1}"], mf.between_se2(relative=relative), noise=noise, loss=mf.huber(scale=2.0))
    keys = np.stack([np.arange(n), np.arange(1, n + 1)], axis=1)
    fields = {"relative": {"translation": translation, "angle": angle}}
    places = many.add_many(mf.between_se2, keys, fields, noise={"sigmas": sigmas}, loss=mf.huber(scale=2.0))
    assert places == (0, n)
    assert [one[i] for i in range(n)] == [many[i] for i in range(n)]
    texts = mf.Graph()
    texts.add_many("between_se2", [(f"x{a}", f"x{b}") for a, b in keys], fields, noise={"sigmas": sigmas})
    assert texts[3].keys == ["x3", "x4"] and texts[3].noise == one[3].noise


def test_a_factor_that_is_the_same_for_all_and_a_prefix_for_each_column() -> None:
    graph = mf.Graph()
    graph.add_many(mf.range_se2_point2(range=2.0), np.array([[0, 7], [1, 8]]), prefix=["x", "l"], noise=0.1)
    assert [graph[i].keys for i in range(2)] == [["x0", "l7"], ["x1", "l8"]]
    assert graph[-1].factor.to_dict() == {"type": "range_se2_point2", "range": 2.0}
    with pytest.raises(IndexError, match="there is no factor 2"):
        graph[2]


@pytest.mark.parametrize("form", ["sigmas", "covariance", "information"])
def test_noise_by_rows(form: str) -> None:
    rng = np.random.default_rng(2)
    root = rng.normal(size=(5, 3, 3))
    array = {"sigmas": rng.uniform(1, 2, size=(5, 3))}.get(form, root @ root.transpose(0, 2, 1) + 3 * np.eye(3))
    graph = mf.Graph()
    keys = np.stack([np.arange(5), np.arange(5) + 1], axis=1)
    fields = {"relative": {"translation": (1.0, 0.0), "angle": 0.0}}
    graph.add_many(mf.between_se2, keys, fields, noise={form: array})
    for i in range(5):
        one = mf.Noise(**{form: array[i]})
        assert graph[i].noise == one
    expected = {"sigmas": np.diag(array[0] ** -2), "covariance": np.linalg.inv(array[0]) if form != "sigmas" else 0}
    np.testing.assert_allclose(mf.Noise(**{form: array[0]}).information_matrix(3), expected.get(form, array[0]))


def test_a_hundred_thousand_factors_are_added_at_once() -> None:
    n = 100_000
    rng = np.random.default_rng(3)
    rotation = rng.normal(size=(n, 4))
    rotation /= np.linalg.norm(rotation, axis=1, keepdims=True)
    fields = {"relative": {"translation": rng.normal(size=(n, 3)), "rotation": rotation}}
    keys = np.stack([np.arange(n), np.arange(n) + 1], axis=1)
    graph = mf.Graph()
    assert graph.add_many(mf.between_se3, keys, fields, noise=0.1) == (0, n)


@given(arrays.arrays(float, st.tuples(st.integers(1, 20), st.just(3)), elements=finite))
def test_values_come_back_as_they_went_in(points: np.ndarray[Any, Any]) -> None:
    values = mf.Values()
    values.insert_many(np.arange(len(points)), mf.Point3, {"position": points}, prefix="l")
    keys, fields = values.columns(mf.Point3)
    assert keys == [f"l{i}" for i in range(len(points))] == list(values)
    np.testing.assert_array_equal(fields["position"], points)
    np.testing.assert_array_equal(values["l0"].position, points[0])


@given(arrays.arrays(float, 6, elements=st.floats(-2, 2)), arrays.arrays(float, 6, elements=st.floats(-1, 1)))
def test_local_undoes_retract(at: np.ndarray[Any, Any], delta: np.ndarray[Any, Any]) -> None:
    x = mf.Se3(translation=[0, 0, 0], rotation=[0, 0, 0, 1]).retract(at)
    np.testing.assert_allclose(x.local(x.retract(delta)), delta, atol=1e-9)
    assert type(x.retract(delta)) is mf.Se3


def test_values_are_a_mapping() -> None:
    _, values = square()
    assert len(values) == 4 and "x1" in values and "y" not in values and values.types() == {"se2": 4}
    del values["x1"]
    assert values.keys() == ["x0", "x2", "x3"]
    with pytest.raises(KeyError, match="there is no variable `x1`"):
        values["x1"]
    with pytest.raises(TypeError, match="expected a value such as Se3"):
        values["x1"] = 3  # type: ignore[assignment]
    assert "3 se2" in repr(values) and "se2" in values._repr_html_()


def test_chosen_things_are_values() -> None:
    a, b = mf.Se2(translation=[1, 2], angle=0.5), mf.Se2(translation=np.array([1, 2]), angle=0.5)
    assert a == b and hash(a) == hash(b) and a != mf.Se2(translation=[1, 2], angle=0.6)
    assert repr(a) == "Se2(translation=[1.0, 2.0], angle=0.5)"
    assert a.to_dict() == {"type": "se2", "translation": [1.0, 2.0], "angle": 0.5}
    with pytest.raises(AttributeError, match="has no field `heading`: there are"):
        a.heading  # noqa: B018
    assert mf.huber().scale == 1.345 and mf.huber() != mf.cauchy()


def test_poses_are_matrices() -> None:
    values = mf.Values({"x": mf.Se3(translation=[1, 2, 3], rotation=[0, 0, np.sin(0.25), np.cos(0.25)])})
    keys, matrices = mf.poses(values)
    assert keys == ["x"] and matrices.shape == (1, 4, 4)
    c, s = np.cos(0.5), np.sin(0.5)
    np.testing.assert_allclose(matrices[0], [[c, -s, 0, 1], [s, c, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]], atol=1e-15)
    flat = mf.poses(mf.Values({"x": mf.Se2(translation=[1, 2], angle=0.5)}), mf.Se2)[1]
    np.testing.assert_allclose(flat[0], [[c, -s, 1], [s, c, 2], [0, 0, 1]])


def test_pandas() -> None:
    pytest.importorskip("pandas")
    _, values = square()
    frame = mf.to_pandas(values, mf.Se2)
    assert list(frame.columns) == ["translation[0]", "translation[1]", "angle"] and frame.loc["x1", "angle"] == 1.5


@pytest.mark.parametrize("extension", ["toml", "json", "yaml"])
def test_a_graph_is_saved_and_loaded(tmp_path: Path, extension: str) -> None:
    graph, values = square()
    graph.fix("x0", ["x", "theta"])
    mf.save(tmp_path / f"graph.{extension}", graph, values)
    read, read_values = mf.load(tmp_path / f"graph.{extension}")
    assert [read[i] for i in range(5)] == [graph[i] for i in range(5)]
    assert read.fixed == {"x0": ["x", "theta"]} and read_values["x3"] == values["x3"]


def test_a_model_of_colmap_is_loaded_and_saved(tmp_path: Path) -> None:
    model = Path(__file__).parents[3] / "examples/bundle"
    graph, values = mf.load(model)
    assert values.types() == {"point3": 80, "radial": 1, "se3": 12}
    solution = mf.solve(graph, values)
    camera = solution.values["camera1"]
    assert abs(camera.f - 700) < 10 and camera.cx == 320
    mf.save(tmp_path / "out", graph, solution.values, like=model)
    again, start = mf.load(tmp_path / "out")
    assert again.cost(start) == pytest.approx(solution.cost, rel=1e-9)
    assert "frame_03.jpg" in (tmp_path / "out/images.txt").read_text()
    with pytest.raises(mf.ManifactorError, match="exists already"):
        mf.save(tmp_path / "out", graph, values, like=model)
    mf.save(tmp_path / "own", graph, solution.values)
    assert mf.load(tmp_path / "own")[0].types() == graph.types()


def test_a_graph_of_another_format(tmp_path: Path) -> None:
    (tmp_path / "a.g2o").write_text("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0.1 1 0 0 1 0 1\n")
    graph, values = mf.load(tmp_path / "a.g2o")
    assert graph.types() == {"between_se2": 1} and values.types() == {"se2": 2}
    with pytest.raises(OSError):
        mf.load(tmp_path / "none.g2o")
    with pytest.raises(mf.errors.UnreadableError) as raised:
        mf.load(tmp_path / "none.toml")
    assert isinstance(raised.value, OSError) and "none.toml" in str(raised.value)


def test_what_does_not_fit_is_told() -> None:
    graph, values = square()
    graph.add(["x0", "l0"], mf.between_se2(relative=mf.Se2(translation=[1, 0], angle=0)))
    assert graph.check(values) == ["factor 5 (between_se2): there is no variable `l0`"]
    with pytest.raises(mf.GraphError, match="there is no variable `l0`") as raised:
        mf.solve(graph, values)
    assert isinstance(raised.value, ValueError)
