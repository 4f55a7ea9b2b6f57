"""A forked process can compute, even if its parent has computed before."""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import os
import subprocess
import sys
import textwrap
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import manifactor as mf
import numpy as np
import pytest

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork"),
    pytest.mark.filterwarnings("ignore:.*fork.*"),
]
ROOT = Path(__file__).parents[3]


def grid(n: int = 40) -> tuple[mf.Graph, mf.Values]:
    """A noisy grid that is large enough for threads."""
    rng = np.random.default_rng(1)
    graph, values = mf.Graph(), mf.Values()
    at = np.stack(np.meshgrid(np.arange(n), np.arange(n)), -1).reshape(-1, 2).astype(float)
    noisy = at + rng.normal(size=at.shape) * 0.1
    values.insert_many(np.arange(n * n), mf.Point2, {"position": noisy})
    right = [(i, i + 1) for i in range(n * n) if (i + 1) % n]
    keys = np.array([*right, *((i, i + n) for i in range(n * (n - 1)))])
    offset = at[keys[:, 1]] - at[keys[:, 0]] + rng.normal(size=(len(keys), 2)) * 0.02
    graph.add_many(mf.between_point2, keys, {"relative": {"position": offset}}, noise=0.05)
    graph.fix("x0")
    return graph, values


GRAPH, VALUES = grid()


def solved() -> float:
    return mf.solve(GRAPH, VALUES).cost


def covariance() -> float:
    return float(mf.solve(GRAPH, VALUES).covariances("x7")["x7"][0, 0])


def updated() -> float:
    session = mf.Smoother()
    session.push(GRAPH, VALUES)
    session.update()
    return session.cost()


def ran() -> float:
    report = mf.run(ROOT / "examples" / "desk" / "desk.toml", set={"source.trajectory.frames": 8})
    return float(report[0].row["ate"])


def batched() -> float:
    @mf.batch(rows=1)
    def norm(a: mf.Point2) -> Any:
        return np.linalg.norm(a, axis=1) - 1

    graph, values = mf.Graph(), mf.Values()
    values.insert_many(np.arange(4), mf.Point2, {"position": np.full((4, 2), 3.0)})
    graph.add_many(norm, np.arange(4)[:, None], {})
    return mf.solve(graph, values, mf.levenberg_marquardt()).cost


def twice_forked() -> float:
    with multiprocessing.get_context("fork").Pool(1) as pool:
        return pool.apply_async(solved).get(60)


def on_threads() -> float:
    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        costs = set(pool.map(lambda _: solved(), range(6)))
    assert len(costs) == 1
    return costs.pop()


@pytest.mark.parametrize("work", [solved, covariance, updated, ran, batched, on_threads, twice_forked])
def test_a_forked_process_gets_the_result_of_its_parent(work: Callable[[], float]) -> None:
    right = solved() if work is twice_forked else work()
    with concurrent.futures.ProcessPoolExecutor(2, multiprocessing.get_context("fork")) as pool:
        if work is twice_forked:
            # a daemon may not have children; processes of an executor are not daemons
            assert pool.submit(work).result(90) == right
        else:
            assert {future.result(90) for future in [pool.submit(work) for _ in range(3)]} == {right}


def warned() -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solved()
        solved()
    return [str(one.message) for one in caught]


def test_a_forked_process_warns_once_that_it_has_one_thread() -> None:
    solved()
    with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("fork")) as pool:
        (message,) = pool.submit(warned).result(90)
    assert "one thread" in message and "forkserver" in message
    assert warned() == []


def test_the_command_line_works_in_a_forked_process(tmp_path: Path) -> None:
    mf.save(tmp_path / "grid.json", GRAPH, VALUES)
    code = """
        import os, sys
        import manifactor as mf
        from manifactor import _native
        graph, values = mf.load("grid.json")
        mf.solve(graph, values)
        if (child := os.fork()) == 0:
            os._exit(_native.main(["manifactor", "solve", "grid.json"]))
        sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    assert subprocess.run(command, cwd=tmp_path, timeout=120, check=False).returncode == 0
