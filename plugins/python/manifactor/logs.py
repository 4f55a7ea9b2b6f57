"""The log of Manifactor as a Python logger."""

from __future__ import annotations

import logging

from . import _native


def enable_logging(level: int = logging.INFO) -> None:
    """Forwards log messages from `level` on to the loggers below `manifactor`; works once per process."""

    def forward(level: int, target: str, message: str) -> None:
        name = target.replace("::", ".").replace("manifactor_", "manifactor.")
        logging.getLogger(name).log(level, "%s", message)

    _native.log_to(forward, level)
