"""The examples of the book run unchanged."""

from __future__ import annotations

import re
from pathlib import Path

import manifactor as mf
import pytest

ROOT = Path(__file__).parents[3]


def blocks_of(page: str) -> list[str]:
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


BLOCKS = blocks_of("docs/python.md")


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_an_example_of_the_book_runs(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    block = BLOCKS[number]
    for module, sign in (("gtsam", "import gtsam"), ("rerun", "to_rerun(")):
        if sign in block:
            pytest.importorskip(module)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    exec(compile(block, f"python.md, block {number}", "exec"), {"__name__": "book"})  # noqa: S102


@pytest.mark.parametrize("page", ["README.md", "plugins/python/README.md", "docs/least-squares.md"])
def test_the_example_of_a_page_runs(page: str) -> None:
    (block,) = blocks_of(page)
    space: dict[str, object] = {}
    exec(compile(block, page, "exec"), space)  # noqa: S102
    assert space["solution"].converged  # type: ignore[attr-defined]


def test_the_model_of_bundles_is_solved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (block,) = blocks_of("docs/bundles.md")
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "docs/bundles.md", "exec"), {})  # noqa: S102
    assert (tmp_path / "refined/images.txt").exists()


def test_the_factors_of_wheels_and_gnss_fit_their_types() -> None:
    (block,) = blocks_of("docs/visual-inertial.md")
    space: dict[str, object] = {}
    exec(compile(block, "docs/visual-inertial.md", "exec"), space)  # noqa: S102
    values = mf.Values({0: mf.Se2.identity(), 1: mf.Se2.identity(), "track": mf.Point1(position=[0.5])})
    assert space["graph"].check(values) == []  # type: ignore[attr-defined]


def test_the_quickstart_is_short() -> None:
    assert len(BLOCKS) >= 10 and len(BLOCKS[0].strip().splitlines()) <= 20


def test_both_ways_of_each_example_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("gtsam")
    loops = [block for block in BLOCKS if "solution = mf.solve(graph, values)" in block and "1.5708" in block]
    theirs = [block for block in BLOCKS if "LevenbergMarquardtOptimizer" in block]
    ours_space: dict[str, object] = {}
    theirs_space: dict[str, object] = {}
    exec(loops[0], ours_space)  # noqa: S102
    exec(theirs[0], theirs_space)  # noqa: S102
    solution, result, graph = ours_space["solution"], theirs_space["result"], theirs_space["graph"]
    error = graph.error(result)  # type: ignore[attr-defined]
    assert solution.cost == pytest.approx(error, rel=1e-4, abs=1e-6)  # type: ignore[attr-defined]
