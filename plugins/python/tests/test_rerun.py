"""A report in the viewer: what is written reads back."""

from __future__ import annotations

from pathlib import Path

import manifactor as mf
import pytest
from test_runs import DESK


def test_a_recording_has_what_the_report_has(tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    report = mf.run(DESK)
    report.to_rerun(tmp_path / "desk.rrd")
    found = entities(tmp_path / "desk.rrd")
    for variant in (r"boxes\ alone", r"a\ formula"):
        for name in ("camera", "camera/boxes", "cost", "error", "estimate/trajectory", "objects/estimate", "truth/trajectory"):
            assert f"/{variant}/{name}" in found, sorted(found)


def entities(path: Path) -> set[str]:
    """The entities of a recording, as rerun reads them."""
    try:
        from rerun.chunk import RrdReader
    except ImportError:
        pytest.skip("this rerun reads recordings in another way")
    return {str(chunk.entity_path) for chunk in RrdReader(path).stream()}
