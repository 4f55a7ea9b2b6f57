"""The log of all parts, as a logger of Python's."""

from __future__ import annotations

import logging

from . import _native


def enable_logging(level: int = logging.INFO) -> None:
    """Hands what is logged from a level on to the loggers below `manifactor`; once for a process."""

    def forward(level: int, target: str, message: str) -> None:
        name = target.replace("::", ".").replace("manifactor_", "manifactor.")
        logging.getLogger(name).log(level, "%s", message)

    _native.log_to(forward, level)
