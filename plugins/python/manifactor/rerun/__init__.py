"""Runs and smoothers in the rerun viewer: `report.to_rerun()`, `smoother.to_rerun()`. Needs
`manifactor[rerun]`."""

from __future__ import annotations

try:
    import rerun
except ModuleNotFoundError as error:
    raise ModuleNotFoundError("the viewer is a package of its own: pip install 'manifactor[rerun]'", name="rerun") from error

from .live import Live
from .report import show

__all__ = ["Live", "show"]
