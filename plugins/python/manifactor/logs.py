"""The log of Manifactor as a Python logger."""

from __future__ import annotations

import logging
import warnings

from . import _native

#: The level of the first call, below which the native part has no messages; and that of the last call.
_levels: list[int] = []


def enable_logging(level: int = logging.INFO) -> None:
    """Forwards log messages from `level` on to the loggers below `manifactor`. A second call changes the level; it
    cannot be below the first one."""
    if _levels:
        if level < _levels[0]:
            warnings.warn(f"messages below the level {_levels[0]} of the first call are not forwarded", stacklevel=2)
        _levels[1:] = [level]
        return

    def forward(level: int, target: str, message: str) -> None:
        if level >= _levels[-1]:
            name = target.replace("::", ".").replace("manifactor_", "manifactor.")
            logging.getLogger(name).log(level, "%s", message)

    _levels.append(level)
    try:
        _native.log_to(forward, level)
    except BaseException:
        _levels.clear()
        raise
