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
    import rerun as rr

    with rr.server.Server(datasets={"desk": [str(path)]}) as server:
        schema = server.client().get_dataset("desk").schema()
        return {column.entity_path for column in schema.component_columns()}
