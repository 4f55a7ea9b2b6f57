"""Runs and sessions in the viewer rerun: `report.to_rerun()`, `session.to_rerun()`. Needs `manifactor[rerun]`."""

from __future__ import annotations

from .live import Live
from .report import show

__all__ = ["Live", "show"]
