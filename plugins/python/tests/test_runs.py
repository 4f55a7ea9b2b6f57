"""Runs and experiments from their documents."""

from __future__ import annotations

import subprocess
import sys
import warnings
from collections.abc import Iterator
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


LIVE: dict[str, Any] = {
    "source": {"type": "json_lines", "camera": {"fx": 500, "fy": 500, "cx": 320, "cy": 240, "width": 640, "height": 480}},
    "objects": {"initialiser": {"type": "rays"}},
    "association": {"type": "likelihood"},
    "semantics": [],
}


def frames_of_a_ball() -> Iterator[dict[str, Any]]:
    """A camera moves to the right and sees one ball of 0.2 m, 2 m ahead."""
    for i in range(20):
        x = 0.05 * i
        centre, half = np.arctan2(-x, 2), np.arcsin(0.1 / np.hypot(x, 2))
        left, right = 320 + 500 * np.tan([centre - half, centre + half])
        high = 500 * 0.1 / np.sqrt(4 - 0.01)
        box = np.array([left, 240 - high, right, 240 + high])
        pose = mf.Se3(translation=[x, 0, 0], rotation=[0, 0, 0, 1])
        as_json = {"translation": pose.translation, "rotation": pose.rotation}
        yield {"timestamp": float(i), "pose": as_json, "boxes": [{"box": box, "class": "ball"}]}


def test_frames_of_a_program_are_mapped_one_by_one() -> None:
    updates: list[dict[str, Any]] = []
    report = mf.online(LIVE, frames_of_a_ball(), on_frame=updates.append)
    assert report.complete and report[0].report["counts"]["objects"] == 1
    assert [update["report"]["frame"] for update in updates[:20]] == list(range(20))
    states = [thing["state"] for update in updates for thing in update["map"]]
    assert states[0] == "tentative" and "mapped" in states
    centre = next(thing["quadric"]["translation"] for update in reversed(updates) for thing in update["map"])
    np.testing.assert_allclose(centre, [0, 0, 2], atol=0.02)


def test_a_frame_that_is_none_is_reported_and_the_rest_is_mapped() -> None:
    frames = list(frames_of_a_ball())
    updates: list[dict[str, Any]] = []
    report = mf.online(LIVE, [*frames[:3], {"pose": None}, "{", *frames[3:]], on_frame=updates.append)
    faults = [update["error"] for update in updates if "error" in update]
    assert len(faults) == 2 and "frames, line 4" in faults[0] and report[0].report["counts"]["frames"] == 20


def test_a_stream_ends_with_its_function_or_an_exception() -> None:
    report = mf.online(LIVE, frames_of_a_ball(), on_frame=lambda update: update["report"]["frame"] < 11)
    assert not report.complete and report[0].report["counts"]["frames"] == 12

    def fail(update: dict[str, Any]) -> None:
        raise ValueError("of the function")

    def broken() -> Iterator[dict[str, Any]]:
        yield from frames_of_a_ball()
        raise ValueError("of the frames")

    with pytest.raises(ValueError, match="of the function"):
        mf.online(LIVE, frames_of_a_ball(), on_frame=fail)
    with pytest.raises(ValueError, match="of the frames"):
        mf.online(LIVE, broken())
    with pytest.raises(mf.SolveError, match="need `source.type = \"json_lines\"`, got `simulated`"):
        mf.online({"source": {"type": "simulated"}}, frames_of_a_ball())


def test_numbers_of_numpy_change_a_document() -> None:
    for frames in (np.int64(8), np.int32(8), np.uint8(8)):
        report = mf.run(DESK, set={"source.trajectory.frames": frames, "detections.noise.sigma": np.float64(0.5)})
        assert len(report[0].trajectory()) == 8


def test_rejected_frames_are_a_warning() -> None:
    frames = list(frames_of_a_ball())
    with pytest.warns(UserWarning, match="frames that were rejected: 2, the first: .*line 4"):
        mf.online(LIVE, [*frames[:3], {"pose": None}, "{", *frames[3:]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mf.online(LIVE, frames)


def test_a_pose_of_a_frame_may_be_a_value() -> None:
    def frames() -> Iterator[dict[str, Any]]:
        for frame in frames_of_a_ball():
            yield {**frame, "pose": mf.Se3(**frame["pose"])}

    updates: list[dict[str, Any]] = []
    report = mf.online(LIVE, frames(), on_frame=updates.append)
    assert report[0].report["counts"]["frames"] == 20 and not any("error" in update for update in updates)


def test_logging_may_be_enabled_twice() -> None:
    code = (
        "import logging, warnings, manifactor as mf\n"
        "mf.enable_logging(); mf.enable_logging(logging.WARNING)\n"
        "warnings.simplefilter('error')\n"
        "try: mf.enable_logging(logging.DEBUG)\n"
        "except UserWarning as warning: print(warning)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and "below the level 20" in done.stdout, done.stderr
