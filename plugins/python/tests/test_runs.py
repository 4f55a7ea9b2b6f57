"""Runs and experiments from their documents."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import manifactor as mf
import numpy as np
import pytest

DESK: dict[str, Any] = {
    "title": "a small desk",
    "source": {
        "type": "simulated",
        "seed": 3,
        "scene": {"seed": 2, "objects": 4},
        "trajectory": {"frames": 20},
    },
    "odometry": {"noise": {"sigma": 0.005}},
    "detections": {"noise": {"sigma": 5.0}},
    "variants": [
        {"name": "boxes alone", "set": {"semantics": []}},
        {"name": "a formula", "set": {"semantics": [{"classes": ["cup", "bottle", "vase"], "factor": {"type": "vertical_orientation_smooth"}, "noise": {"sigma": 0.1}}]}},
    ],
}


def test_a_run_tells_what_it_found() -> None:
    report = mf.run(DESK)
    assert report.title == "a small desk" and report.complete and len(report) == 2
    assert [variant.name for variant in report] == ["boxes alone", "a formula"]
    variant = report["boxes alone"]
    assert variant.converged and 0 < variant.row["ate"] < variant.row["odometry_ate"] and variant.row["objects"] == 4
    poses = variant.trajectory()
    assert len(poses) == 20 and poses.translation.shape == (20, 3) and poses.rotation.shape == (20, 4)
    np.testing.assert_allclose(np.linalg.norm(poses.rotation, axis=1), 1)
    truth = variant.trajectory("truth")
    assert np.abs(truth.translation - poses.translation).max() < 1
    assert len(variant.objects) == 4 and variant.report["counts"]["objects"] >= 1
    assert "<iframe" in report._repr_html_() and "</html>" in report.html
    with pytest.raises(KeyError, match="there is no variant 'c'"):
        report["c"]


def test_settings_are_set_from_outside() -> None:
    report = mf.run(DESK, set={"source.trajectory.frames": 12, "title": "shorter"})
    assert report.title == "shorter" and len(report[0].trajectory()) == 12
    again = mf.run(DESK, set=["source.trajectory.frames=12"])
    assert again[0].row["final_cost"] == report[0].row["final_cost"]


def test_a_document_with_mistakes(tmp_path: Path) -> None:
    document = tmp_path / "run.toml"
    document.write_text('[source]\ntype = "simulated"\nseeed = 3\n\n[odometry]\nnoise = { sigma = "small" }\n')
    with pytest.raises(mf.DocumentError) as raised:
        mf.run(document)
    assert [mistake.line for mistake in raised.value.mistakes] == [(3, 1), (6, 19)]
    assert raised.value.mistakes[0].help is not None and "did you mean `seed`" in raised.value.mistakes[0].help
    assert f"{document}:3:1: unknown field `seeed`" in str(raised.value)


def test_an_observer_may_end_a_run() -> None:
    report = mf.run(DESK, observer=lambda _: False)
    assert not report.complete


def test_pandas() -> None:
    pytest.importorskip("pandas")
    frame = mf.run(DESK).to_pandas()
    assert list(frame.index) == ["boxes alone", "a formula"] and frame.loc["a formula", "ate"] > 0


def test_an_experiment_goes_on_where_it_was(tmp_path: Path) -> None:
    base = tmp_path / "base.toml"
    base.write_text(
        '[source]\ntype = "simulated"\nseed = 3\nscene = { seed = 2, objects = 3 }\ntrajectory = { frames = 10 }\n'
        "[odometry]\nnoise = { sigma = 0.005 }\n[detections]\nnoise = { sigma = 5.0 }\n"
    )
    sweep = tmp_path / "sweep.toml"
    sweep.write_text('base = "base.toml"\n[[axes]]\ncolumns = { seed = "source.seed" }\nrows = [1, 2, 3]\n')
    shown: list[tuple[int, int]] = []
    summary = mf.experiment(sweep, out=tmp_path / "out", progress=lambda done, of: shown.append((done, of)))
    assert shown[0] == (0, 3) and shown[-1] == (3, 3) and summary.folder == tmp_path / "out"
    assert summary.summary["groups"]
    first = (tmp_path / "out" / "trials.csv").read_bytes()
    shown.clear()
    mf.experiment(sweep, out=tmp_path / "out", progress=lambda done, of: shown.append((done, of)))
    assert shown == [(3, 3)] and (tmp_path / "out" / "trials.csv").read_bytes() == first

    def fails(done: int, of: int) -> None:
        raise LookupError("of the progress")

    with pytest.raises(LookupError, match="of the progress"):
        mf.experiment(sweep, out=tmp_path / "other", progress=fails)


def manifactor(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "manifactor", *arguments], capture_output=True, text=True)


def test_the_command_line() -> None:
    version = manifactor("--version")
    assert version.returncode == 0 and version.stdout.strip() == f"manifactor {mf.__version__}"
    assert manifactor("solve", "none.g2o").returncode == 3
    assert manifactor("frobnicate").returncode == 2
    explained = manifactor("explain", "between_se3")
    assert "relative" in explained.stdout


def test_the_log_goes_to_python() -> None:
    code = (
        "import logging, sys, manifactor as mf\n"
        "logging.basicConfig(stream=sys.stdout, level=logging.INFO, format='%(levelname)s %(name)s %(message)s')\n"
        "mf.enable_logging(logging.INFO)\n"
        "graph = mf.Graph()\n"
        "graph.add('x', mf.prior_point1(value=mf.Point1(position=[1])))\n"
        "mf.solve(graph, mf.Values({'x': mf.Point1(position=[0])}))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "INFO manifactor.solve converged" in done.stdout, done.stdout + done.stderr
