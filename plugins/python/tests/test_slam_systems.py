"""The page on SLAM systems: its converter joins exports of RTAB-Map to frames, and its documents run."""

from __future__ import annotations

import ast
import contextlib
import io
import itertools
import json
import operator
import re
from pathlib import Path
from typing import Any

import manifactor as mf
import numpy as np
import pytest

PAGE = (Path(__file__).parents[3] / "docs" / "slam-systems.md").read_text(encoding="utf-8")
(CONVERTER,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
CAMERA = {"fx": 320.0, "fy": 320.0, "cx": 320.0, "cy": 240.0, "width": 640, "height": 480}
NODES = 24


def numbers(pose: Any) -> str:
    return " ".join(repr(float(x)) for x in (*pose.translation, *pose.rotation))


def detections(camera: Any) -> list[str]:
    """Boxes of a ball of 10 cm half a metre above the centre, by its outline."""
    x, y, z = np.array((camera.inverse() @ [0.0, 0.0, 0.5]))
    radius = 320 * 0.1 / z
    u, v = 320 + 320 * x / z, 240 + 320 * y / z
    return [repr(float(side)) for side in (u - radius, v - radius, u + radius, v + radius)]


def test_exports_of_rtabmap_become_frames_with_closures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # a robot drives a circle of 2 m around the ball; its camera looks to the left, 0.4 m above the floor
    turn = mf.Se3.exp([0, 0, 2 * np.pi / NODES, 0, 0, 0])
    start = mf.Se3(translation=[2.0, 0, 0], rotation=[0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    truth = [t * start for t in itertools.accumulate([turn] * (NODES - 1), operator.mul, initial=mf.Se3.identity())]
    mount = mf.Se3.from_matrix(np.array([[1.0, 0, 0, 0.1], [0, 0, 1, 0], [0, -1, 0, 0.4], [0, 0, 0, 1]]))
    drift = mf.Se3.exp([0, 0, 0.004, 0.003, 0, 0])
    steps = [a.between(b) * drift for a, b in itertools.pairwise(truth)]
    robot = list(itertools.accumulate(steps, operator.mul, initial=truth[0]))
    stamps = [100.0 + 0.5 * i for i in range(NODES)]
    ids = [7 + 3 * i for i in range(NODES)]
    for name, poses in (("robot", robot), ("camera", [pose * mount for pose in robot])):
        rows = [f"{t} {numbers(pose)} {node}" for t, pose, node in zip(stamps, poses, ids, strict=True)]
        Path(f"{name}.txt").write_text("#timestamp x y z qx qy qz qw id\n" + "\n".join(rows) + "\n", encoding="utf-8")
    last = NODES - 1
    edges = [(0, 1, truth[0].between(truth[1])), (last, 0, truth[last].between(truth[0]))]
    information = " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1"
    graph = [f"EDGE_SE3:QUAT {ids[a]} {ids[b]} {numbers(z)}{information}" for a, b, z in edges]
    Path("graph.g2o").write_text("\n".join(graph) + "\n", encoding="utf-8")
    boxes = [",".join([str(t), "ball", "0.9", *detections(pose * mount)]) for t, pose in zip(stamps, truth, strict=True)]
    Path("detections.csv").write_text("timestamp,class_name,score,xmin,ymin,xmax,ymax\n" + "\n".join(boxes) + "\n", encoding="utf-8")

    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        exec(compile(CONVERTER, "slam-systems.md", "exec"), {"__name__": "book"})  # noqa: S102

    printed = ast.literal_eval(output.getvalue().partition(": ")[2])
    np.testing.assert_allclose(mf.Se3(**printed).between(mount).log(), 0, atol=1e-9)
    frames = [json.loads(line) for line in Path("frames.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [len(frame["boxes"]) for frame in frames] == [1] * NODES
    (closure,) = frames[last]["factors"]
    assert closure["id"] == f"{ids[0]}-{ids[last]}" and not any(frame["factors"] for frame in frames[:last])
    relative = mf.Se3(**closure["factor"]["relative"])
    expected = truth[0].between(truth[last])
    np.testing.assert_allclose(relative.between(expected).log(), 0, atol=1e-9)

    document: dict[str, Any] = {
        "source": {
            "type": "json_lines",
            "file": str(tmp_path / "frames.jsonl"),
            "camera": CAMERA,
            "body_from_camera": printed,
        },
        "association": {"type": "likelihood"},
        "odometry": {"noise": {"sigma": 0.01}},
        "detections": {"noise": {"sigma": 2.0}, "loss": {"type": "cauchy"}},
    }
    variant = mf.run(document)[0]
    end = variant.trajectory().translation[last]
    true_end, odometry_end = (truth[last] * mount).translation, (robot[last] * mount).translation
    error, before = np.linalg.norm(end - true_end), np.linalg.norm(odometry_end - true_end)
    assert error < 0.2 * before, (error, before)
    assert variant.row["objects"] == 1
