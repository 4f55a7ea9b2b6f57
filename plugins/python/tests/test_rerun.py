"""Runs and smoothers in the viewer: a written recording reads back."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import manifactor as mf
import numpy as np
import pytest
from test_runs import DESK

CAMERA: mf.types.Camera = {"fx": 320.0, "fy": 320.0, "cx": 320.0, "cy": 240.0, "width": 640, "height": 480}


def test_a_recording_has_what_the_report_has(tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    report = mf.run(DESK)
    report.to_rerun(tmp_path / "desk.rrd")
    found = {path for path, _ in logged(tmp_path / "desk.rrd")}
    for variant in (r"boxes\ alone", r"a\ formula"):
        for name in ("camera", "camera/boxes", "cost", "error", "estimate/trajectory", "objects/estimate", "truth/trajectory"):
            assert f"/{variant}/{name}" in found, sorted(found)


def frame(number: int) -> tuple[mf.Graph, mf.Values]:
    """A camera that moves along x past an object, and detects it as a box."""
    pose = mf.Se3(translation=[0.1 * number, 0, 0], rotation=[0, 0, 0, 1])
    graph, values = mf.Graph(), mf.Values({f"x{number}": pose})
    if number == 0:
        graph.fix("x0")
        ball = mf.DualQuadric(translation=[0, 0, 2], rotation=[0, 0, 0, 1], semi_axes=[0.2, 0.2, 0.2])
        graph.add("q0", mf.prior_quadric(value=ball), noise=0.1)
        point = mf.Point3(position=[1, 1, 1])
        graph.add("p0", mf.prior_point3(value=point))
        values["q0"], values["p0"] = ball, point
    else:
        relative = mf.Se3(translation=[0.1, 0, 0], rotation=[0, 0, 0, 1])
        graph.add([f"x{number - 1}", f"x{number}"], mf.between_se3(relative=relative), noise=0.01)
    left = 288.0 - 16 * number
    box = mf.bounding_box(box=[left, 208, left + 64, 272], camera=CAMERA)
    graph.add([f"x{number}", "q0"], box, noise=mf.Noise(2.0))
    return graph, values


def test_a_session_is_logged_as_it_comes(tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    session = mf.Smoother()
    with session.to_rerun(tmp_path / "drive.rrd") as shown:
        for number in range(4):
            shown.push(*frame(number))
            assert shown.update(seconds=10 + 0.5 * number)["passes"] >= 1
    rows = logged(tmp_path / "drive.rrd")

    def of(name: str, component: str) -> list[dict[str, Any]]:
        return [row for path, row in rows if path == f"/session/{name}" and row.get(component) is not None]

    poses = of("camera", "Transform3D:translation")
    assert [row["iteration"] for row in poses] == [0, 1, 2, 3]
    assert [row["time"].total_seconds() for row in poses] == [10, 10.5, 11, 11.5]
    np.testing.assert_allclose(poses[3]["Transform3D:translation"][0], session["x3"].translation, atol=1e-6)
    lines = of("estimate/trajectory", "LineStrips3D:strips")
    assert [len(row["LineStrips3D:strips"][0]) for row in lines] == [1, 2, 3, 4]
    solid = of("objects/estimate", "Ellipsoids3D:half_sizes")[-1]
    np.testing.assert_allclose(solid["Ellipsoids3D:half_sizes"][0], session["q0"].semi_axes, atol=1e-6)
    assert solid["Ellipsoids3D:labels"] == ["q0"] and len(of("points", "Points3D:positions")) == 4
    boxes = of("camera/boxes", "Boxes2D:half_sizes")
    assert len(boxes) == 4 and boxes[2]["Boxes2D:labels"] == ["q0"]
    np.testing.assert_allclose(boxes[2]["Boxes2D:centers"], [[288, 240]])
    assert of("camera", "Pinhole:resolution")[0]["Pinhole:resolution"] == [[640, 480]]
    costs, latencies = of("cost", "Scalars:scalars"), of("latency", "Scalars:scalars")
    assert costs[-1]["Scalars:scalars"] == pytest.approx([session.cost()])
    assert len(latencies) == 4 and all(row["Scalars:scalars"][0] > 0 for row in latencies)


def test_poses_that_have_left_stay_in_the_line_and_those_of_a_plane_lie_in_it(tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    with mf.Smoother(window={"poses": 2}).to_rerun(tmp_path / "plane.rrd", name="a plane", every=2) as shown:
        for number in range(5):
            graph, values = mf.Graph(), mf.Values({f"x{number}": mf.Se2(translation=[number, 1], angle=np.pi / 2)})
            if number == 0:
                graph.fix("x0")
            else:
                step = mf.between_se2(relative=mf.Se2(translation=[0, -1], angle=0))
                graph.add([f"x{number - 1}", f"x{number}"], step, noise=0.1)
            shown.push(graph, values)
            shown.update()
        assert "x0" not in shown.smoother
    rows = [row for path, row in logged(tmp_path / "plane.rrd") if path == r"/a\ plane/estimate/trajectory"]
    assert [row["iteration"] for row in rows] == [0, 2, 4]
    line = np.array(rows[-1]["LineStrips3D:strips"][0])
    np.testing.assert_allclose(line, [[i, 1, 0] for i in (0, 1, 2, 3, 4)], atol=1e-6)
    with pytest.raises(ValueError, match="every: expected a number of updates from 1, got 0"):
        mf.Smoother().to_rerun(tmp_path / "none.rrd", every=0)


def test_a_viewer_that_is_not_there_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    monkeypatch.delitem(sys.modules, "manifactor.rerun", raising=False)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'manifactor\[rerun\]'"):
        mf.Smoother().to_rerun(tmp_path / "none.rrd")


def logged(path: Path) -> list[tuple[str, dict[str, Any]]]:
    """Returns the rows of a recording as rerun reads them: the entity, its components and its times."""
    try:
        from rerun.chunk import RrdReader
    except ImportError:
        pytest.skip("this rerun reads recordings in another way")
    chunks = RrdReader(path).stream()
    return [(str(chunk.entity_path), row) for chunk in chunks for row in chunk.to_record_batch().to_pylist()]
