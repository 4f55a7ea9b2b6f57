"""Runs and experiments, and their results."""

from __future__ import annotations

import html
import json
import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from .chosen import Variable
from .errors import ExistsError, Mistake

#: A file, or the content of one.
Config = str | os.PathLike[str] | Mapping[str, Any]
Array = NDArray[np.float64]


class Page:
    """A page for a browser, which needs no network."""

    def __init__(self, html: str) -> None:
        #: The page.
        self.html = html

    def __repr__(self) -> str:
        return f"Page({len(self.html)} characters)"

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.html)}" style="width: 100%; height: 720px; border: 0"></iframe>'

    def save_html(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Writes the page. An existing file is replaced only with `force`."""
        written(path, self.html, force)


class Trajectory:
    """Poses by time: from the camera's frame (z forward) to the frame of the truth, or of the map if there
    is no truth."""

    def __init__(self, seconds: Array, translation: Array, rotation: Array) -> None:
        #: Timestamps, shape (n,). Unit: seconds.
        self.seconds = seconds
        #: Positions, shape (n, 3). Unit: metres.
        self.translation = translation
        #: Unit quaternions (x, y, z, w), shape (n, 4).
        self.rotation = rotation

    def __len__(self) -> int:
        return len(self.seconds)


class Variant:
    """One variant of a run, as in its files: `report` has the figures, `record` everything for drawing."""

    def __init__(self, report: dict[str, Any], row: dict[str, Any], record: dict[str, Any]) -> None:
        self.report, self.record = report, record
        #: Row in the table of the run: costs, errors of the estimate if there is a truth, seconds.
        self.row = row
        self.name: str = report["name"]

    def __repr__(self) -> str:
        return f"Variant({self.name!r}, {self.report['counts']['objects']} objects)"

    @property
    def converged(self) -> bool:
        """True if the solve reached a minimum."""
        return bool(self.report["solve"]["termination"]["status"] == "converged")

    def trajectory(self, which: str = "estimate") -> Trajectory:
        """Returns the poses of the `estimate`, of the `odometry`, or of the `truth`."""
        frames = [frame for frame in self.record["frames"] if frame.get(which) is not None]
        poses = [frame[which].get("pose", frame[which]) for frame in frames]
        return Trajectory(
            np.array([frame["timestamp"] for frame in frames], dtype=float),
            np.array([pose["translation"] for pose in poses], dtype=float).reshape(-1, 3),
            np.array([pose["rotation"] for pose in poses], dtype=float).reshape(-1, 4),
        )

    @property
    def objects(self) -> list[dict[str, Any]]:
        """Returns the detected objects by number: class, status, estimate and error."""
        return list(self.report["objects"])


class Report(Page):
    """Result of a run, and its page with the map in 3D."""

    def __init__(
        self, report: dict[str, Any], table: list[dict[str, Any]], record: dict[str, Any], page: str
    ) -> None:
        self.title: str = report["title"]
        self.complete: bool = report["complete"]
        self.seconds: float = report["seconds"]
        self.variants = [Variant(*of) for of in zip(report["variants"], table, record["variants"], strict=True)]
        super().__init__(page)

    def __iter__(self) -> Iterator[Variant]:
        return iter(self.variants)

    def __len__(self) -> int:
        return len(self.variants)

    def __getitem__(self, name: str | int) -> Variant:
        if isinstance(name, int):
            return self.variants[name]
        for variant in self.variants:
            if variant.name == name:
                return variant
        raise KeyError(f"there is no variant {name!r}: there are {', '.join(v.name for v in self.variants)}")

    def __repr__(self) -> str:
        return f"Report({self.title!r}, {len(self)} variants, {self.seconds:.2f} s)"

    def to_pandas(self) -> Any:
        """Returns the table of the run as a `pandas.DataFrame`, with one row per variant."""
        import pandas

        return pandas.DataFrame([variant.row for variant in self]).set_index("variant")

    def to_rerun(self, path: str | os.PathLike[str] | None = None, *, name: str = "manifactor") -> None:
        """Shows the run in the rerun viewer, or writes it to a `.rrd` file; needs `manifactor[rerun]`."""
        from .rerun import show

        show(self, path, name)


def written(path: str | os.PathLike[str], text: str, force: bool) -> None:
    """Writes a new file, or replaces an existing one with `force`."""
    try:
        with open(path, "w" if force else "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise exists(path) from None


def exists(path: str | os.PathLike[str]) -> ExistsError:
    """Makes the exception for a file that is there already."""
    return ExistsError("", [Mistake(os.fspath(path), "the file exists already", "`force=True` replaces it")])


def overrides(values: Mapping[str, Any] | Sequence[str]) -> list[str]:
    """Formats overrides as `key=value`, as on the command line."""
    if isinstance(values, Mapping):
        return [f"{key}={toml(value)}" for key, value in values.items()]
    return list(values)


def toml(value: Any) -> str:
    """Formats a value as TOML."""
    match value:
        case np.generic():
            return toml(value.item())
        case bool():
            return "true" if value else "false"
        case int() | float():
            return repr(value)
        case str() | os.PathLike():
            return json.dumps(os.fspath(value), ensure_ascii=False)
        case Mapping():
            return "{ " + ", ".join(f"{json.dumps(key)} = {toml(item)}" for key, item in value.items()) + " }"
        case np.ndarray():
            return toml(value.tolist())
        case _ if hasattr(value, "to_dict"):
            return toml(value.to_dict())
        case _:
            return "[" + ", ".join(toml(item) for item in value) + "]"


def opened(config: Config, name: str) -> tuple[str, str | None]:
    """Returns the path of a document, and its text if there is no file."""
    if isinstance(config, Mapping):
        return name, json.dumps(config, default=plain)
    return os.fspath(config), None


def data_folder(data: str | os.PathLike[str] | None) -> str | None:
    return os.fspath(data) if data is not None else os.environ.get("MANIFACTOR_DATA")


def run(
    config: Config,
    *,
    set: Mapping[str, Any] | Sequence[str] = (),
    data: str | os.PathLike[str] | None = None,
    observer: Callable[[dict[str, Any]], bool | None] | None = None,
) -> Report:
    """Builds, solves and evaluates the run of a document in memory, and writes no files.

    `config` is a file, or a dict with its content. `set` changes values by their path, like `--set`:
    `set={"source.seed": 2}`. `data` is the folder of public data sets. Default: `MANIFACTOR_DATA`.
    `observer` is called with a dict after each step of a solve, and ends it by returning `False`.
    `manifactor run` writes a folder with pictures.
    """
    path, text = opened(config, "run")
    report, table, record, page = _native.run(path, text, overrides(set), data_folder(data), observer)
    return Report(json.loads(report), json.loads(table), json.loads(record), page)


def online(
    config: Config,
    frames: Iterable[Mapping[str, Any] | str] | None = None,
    *,
    on_frame: Callable[[dict[str, Any]], bool | None] | None = None,
    set: Mapping[str, Any] | Sequence[str] = (),
    data: str | os.PathLike[str] | None = None,
) -> Report:
    """Maps the run of a document frame by frame in memory, and solves the whole graph at the end.

    `frames` are dicts or lines of JSON in the form of `manifactor schema frame`, for a document whose source is
    `json_lines`. Default: the frames of the source. `on_frame` is called after each frame with a dict: the `report` of the
    frame, with its pose and the objects of its boxes; in `map`, the objects that have changed; or the `error` of a frame
    that was rejected. It ends the stream by returning `False`. Without `on_frame`, a warning has the number of
    rejected frames. `set` and `data` are those of :func:`run`.
    """
    path, text = opened(config, "run")
    lines = None if frames is None else (frame if isinstance(frame, str) else json.dumps(frame, default=part_of_frame) for frame in frames)
    results, rejected, first = _native.online(path, text, overrides(set), data_folder(data), lines, on_frame)
    if rejected and on_frame is None:
        warnings.warn(f"frames that were rejected: {rejected}, the first: {first}", stacklevel=2)
    report, table, record, page = results
    return Report(json.loads(report), json.loads(table), json.loads(record), page)


def plain(value: Any) -> Any:
    """Converts values of this package, arrays and paths for JSON."""
    if hasattr(value, "to_dict"):
        return value.to_dict()
    return value.tolist() if hasattr(value, "tolist") else os.fspath(value)


def part_of_frame(value: Any) -> Any:
    """Converts a part of a frame for JSON. The fields of frames have fixed types, which values do not repeat."""
    fields = plain(value)
    return {name: item for name, item in fields.items() if name != "type"} if isinstance(value, Variable) else fields


class Summary:
    """Result of an experiment: `summary` as in `summary.json` (empty for a shard), and the folder of the
    tables."""

    def __init__(self, summary: dict[str, Any], folder: Path) -> None:
        self.summary, self.folder = summary, folder

    def __repr__(self) -> str:
        return f"Summary({self.folder}, {self.summary.get('open', 0)} trials open)"

    def trials(self) -> Any:
        """Returns the trials as a `pandas.DataFrame`, with one row per trial."""
        import pandas

        return pandas.read_csv(self.folder / "trials.csv")


def experiment(
    config: Config,
    *,
    set: Mapping[str, Any] | Sequence[str] = (),
    data: str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] | None = None,
    force: bool = False,
    retry_failed: bool = False,
    threads: int | None = None,
    shard: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Summary:
    """Runs the unfinished trials of an experiment, and writes its tables, pictures and page.

    Finished trials are saved in `trials.jsonl` of its folder, so after Ctrl-C or a kill the same call
    continues. `progress` is called with the number of finished trials and the total. `shard="2/8"` runs the
    second of eight parts in a separate folder without tables; the same call without `shard` collects the
    trials of all parts. `manifactor.ray` distributes trials over a cluster.
    """
    path, text = opened(config, "experiment")
    out = None if out is None else os.fspath(out)
    summary, folder = _native.experiment(
        path, text, overrides(set), data_folder(data), out, force, retry_failed, threads, shard, progress
    )
    return Summary(json.loads(summary or "{}"), Path(folder))
