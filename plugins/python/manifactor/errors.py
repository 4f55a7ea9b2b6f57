"""Exceptions. Each describes the mistake, its place, the expected input and a remedy, in its text and in
`mistakes`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Mistake:
    """One mistake in the input."""

    #: The argument, such as `camera.fx`, or the file.
    place: str
    message: str
    #: A remedy.
    help: str | None = None
    #: Line and column in the file, from 1.
    line: tuple[int, int] | None = None
    #: The surrounding text, the position of the first wrong character, and the number of wrong characters.
    within: tuple[str, int, int] | None = None

    def __str__(self) -> str:
        place = self.place if self.line is None else f"{self.place}:{self.line[0]}:{self.line[1]}"
        text = f"{place}: {self.message}" if place else self.message
        if self.within is not None:
            formula, start, length = self.within
            text += f"\n  {formula}\n  {' ' * start}{'^' * length}\n"
        return f"{text} ({self.help})" if self.help and self.within is None else text + (self.help or "")


class ManifactorError(Exception):
    """Base class of all exceptions of this package."""

    def __init__(self, what: str = "", mistakes: Sequence[Mistake] = ()) -> None:
        self.what = what
        self.mistakes = tuple(mistakes)
        lines = "\n".join(str(mistake) for mistake in self.mistakes)
        super().__init__(f"{what}: {lines}" if what and lines else what or lines)


class ArgumentError(ManifactorError, ValueError):
    """An invalid argument, which `mistakes` names."""


class GraphError(ManifactorError, ValueError):
    """A graph, values and a solver that do not fit together."""


class DocumentError(ManifactorError, ValueError):
    """A document with mistakes, each with its line and column."""


class UnreadableError(DocumentError, OSError):
    """A file that does not exist or cannot be read."""


class ExistsError(ManifactorError, FileExistsError):
    """A file that already exists; it is replaced only with `force=True`."""


class SolveError(ManifactorError, RuntimeError):
    """A failure with valid input, such as the covariance of an undetermined variable, or missing data."""


class FileError(SolveError, OSError):
    """A file or folder of results that cannot be written or read."""


class TraceError(ManifactorError, TypeError):
    """A factor in Python that cannot be converted to a formula; the traceback ends at its line."""
