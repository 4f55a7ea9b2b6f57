"""What can go wrong. Each error says what, where, what was expected and what to do, in its text and in `mistakes`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Mistake:
    """One thing that is wrong."""

    #: The argument, such as `camera.fx`, or the file.
    place: str
    message: str
    #: What to do about it.
    help: str | None = None
    #: Line and column, from 1, of what was read from a file.
    line: tuple[int, int] | None = None
    #: A text that it is within, with the first of the characters that are meant, and their number.
    within: tuple[str, int, int] | None = None

    def __str__(self) -> str:
        place = self.place if self.line is None else f"{self.place}:{self.line[0]}:{self.line[1]}"
        text = f"{place}: {self.message}" if place else self.message
        if self.within is not None:
            formula, start, length = self.within
            text += f"\n  {formula}\n  {' ' * start}{'^' * length}\n"
        return f"{text} ({self.help})" if self.help and self.within is None else text + (self.help or "")


class ManifactorError(Exception):
    """The base of all of them."""

    def __init__(self, what: str = "", mistakes: Sequence[Mistake] = ()) -> None:
        self.what = what
        self.mistakes = tuple(mistakes)
        lines = "\n".join(str(mistake) for mistake in self.mistakes)
        super().__init__(f"{what}: {lines}" if what and lines else what or lines)


class ArgumentError(ManifactorError, ValueError):
    """An argument that is not as it should be; `mistakes` name it."""


class GraphError(ManifactorError, ValueError):
    """A graph, values and a solver that do not fit each other."""


class DocumentError(ManifactorError, ValueError):
    """A document with mistakes, each with its line and column."""


class UnreadableError(DocumentError, OSError):
    """A file that is not there, or cannot be read."""


class ExistsError(ManifactorError, FileExistsError):
    """A file that exists, and is replaced only with `force=True`."""


class SolveError(ManifactorError, RuntimeError):
    """What could not be done with input that is right: a covariance of what nothing constrains, data that are not there."""


class FileError(SolveError, OSError):
    """A file or folder of results that cannot be written or read."""


class TraceError(ManifactorError, TypeError):
    """A factor of Python that cannot be written as a formula; the traceback ends at the line."""
