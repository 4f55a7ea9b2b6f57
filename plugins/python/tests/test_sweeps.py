"""Experiments in parts and over Ray give the tables of a single run."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import manifactor as mf
import pytest

BASE = """
source = { type = "simulated", scene = { objects = 3 }, trajectory = { frames = 12 } }
odometry = { noise = { sigma = 0.005 } }
detections = { noise = { sigma = 5.0 } }
"""
SWEEP = """
title = "small"
base = "base.toml"
[[axes]]
columns = { seed = "source.seed" }
rows = [1, 2, 3, 4, 5, 6]
[[axes]]
columns = { scene = "source.scene.seed" }
rows = [1, 2]
[summary]
by = ["scene"]
resamples = 50
"""
TABLES = ("trials.csv", "trials.parquet", "summary.csv", "summary.md", "summary.json")


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    (tmp_path / "base.toml").write_text(BASE)
    (tmp_path / "sweep.toml").write_text(SWEEP)
    return tmp_path / "sweep.toml"


def tables(folder: Path) -> list[bytes]:
    return [(folder / name).read_bytes() for name in TABLES]


def test_parts_are_merged(sweep: Path, tmp_path: Path) -> None:
    whole = mf.experiment(sweep, out=tmp_path / "whole")
    for part in ("1/3", "2/3", "3/3"):
        made = mf.experiment(sweep, out=tmp_path / "parts", shard=part)
        assert made.summary == {} and not (made.folder / "trials.csv").exists()
    begun: list[tuple[int, int]] = []
    merged = mf.experiment(sweep, out=tmp_path / "parts", progress=lambda done, of: begun.append((done, of)))
    assert begun == [(12, 12)] and tables(merged.folder) == tables(whole.folder)
    with pytest.raises(mf.ArgumentError, match="shard: expected K/N, the K-th of N parts, such as 2/8; got `4/3`"):
        mf.experiment(sweep, out=tmp_path / "parts", shard="4/3")


def workers() -> list[int]:
    """Returns the Ray processes that run a trial now."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            command = (process / "cmdline").read_text()
        except OSError:
            continue
        if command.startswith("ray::run_trial"):
            found.append(int(process.name))
    return found


def test_a_worker_of_ray_is_killed_and_the_tables_are_the_same(sweep: Path, tmp_path: Path) -> None:
    pytest.importorskip("ray")
    from manifactor.ray import experiment

    whole = mf.experiment(sweep, out=tmp_path / "whole")
    killed: list[int] = []

    def kill(done: int, of: int) -> None:
        deadline = time.monotonic() + 5
        while not killed and time.monotonic() < deadline:
            for worker in workers()[:1]:
                os.kill(worker, signal.SIGKILL)
                killed.append(worker)

    over_ray = experiment(sweep, out=tmp_path / "ray", workers=2, progress=kill)
    assert tables(over_ray.folder) == tables(whole.folder) and len(killed) == 1


def test_a_driver_that_ends_is_followed_by_another(sweep: Path, tmp_path: Path) -> None:
    pytest.importorskip("ray")
    from manifactor.ray import experiment

    class Ends(Exception):
        pass

    def ends(done: int, of: int) -> None:
        if done == 4:
            raise Ends

    with pytest.raises(Ends):
        experiment(sweep, out=tmp_path / "ray", workers=2, progress=ends)
    begun: list[tuple[int, int]] = []
    after = experiment(sweep, out=tmp_path / "ray", workers=2, progress=lambda done, of: begun.append((done, of)))
    assert begun[-1] == (8, 8)
    assert tables(after.folder) == tables(mf.experiment(sweep, out=tmp_path / "whole").folder)
