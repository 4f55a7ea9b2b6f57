"""An experiment over Ray: `python -m manifactor.ray SWEEP`. Needs `manifactor[ray]`.

The driver owns the journal, and the workers run the trials, each on one processor. If a worker dies, its
trial is repeated. If the driver dies, the same command continues with the remaining trials. The files are
those of `manifactor experiment`, and the tables are byte for byte equal. Each worker reads the documents
and data from the same paths.
"""

from __future__ import annotations

import argparse
import functools
import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from . import _native
from .errors import ManifactorError
from .report import Config, Summary, data_folder, opened, overrides

#: Number of repetitions of a trial after the death of its worker.
RETRIES = 5

#: Arguments with which a worker opens the experiment: path, text (if there is no file), overrides, and the
#: folder of data.
Opened = tuple[str, str | None, tuple[str, ...], str | None]


@functools.lru_cache(maxsize=4)
def _sweep(of: Opened) -> Any:
    """Returns the experiment in a worker, which reads it only once."""
    path, text, set, data = of
    return _native.Sweep(path, text, list(set), data, None, False, False)


def run_trial(of: Opened, number: int) -> str:
    """Runs a trial in a worker, and returns its line of the journal."""
    line: str = _sweep(of).run(number)
    return line


def experiment(
    config: Config,
    *,
    set: Mapping[str, Any] | Sequence[str] = (),
    data: str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] | None = None,
    force: bool = False,
    retry_failed: bool = False,
    address: str | None = None,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Summary:
    """Runs the unfinished trials of an experiment on the workers of a cluster, and writes its tables,
    pictures and page.

    `address` is the address of a cluster. Without it, a local cluster with `workers` workers is started. An
    existing connection of Ray is reused. `progress` is called with the number of trials finished in this
    call and their total.
    """
    import ray

    path, text = opened(config, "experiment")
    if text is None:
        path = os.path.abspath(path)
    # a worker may have a different working directory
    folder = data_folder(data)
    of = (path, text, tuple(overrides(set)), None if folder is None else os.path.abspath(folder))
    sweep = _native.Sweep(path, text, list(of[2]), of[3], None if out is None else os.fspath(out), force, True)
    own = not ray.is_initialized()
    if own and address is None:
        # a local cluster is not visible to other machines
        ray.init(num_cpus=workers, include_dashboard=False, log_to_driver=False, _node_ip_address="127.0.0.1")
    elif own:
        ray.init(address=address, log_to_driver=False)
    try:
        if retry_failed:
            sweep.retry_failed()
        waiting = sweep.open()
        trial = ray.remote(num_cpus=1, max_retries=RETRIES)(run_trial)
        running = {trial.remote(of, number): number for number in waiting}
        total = len(waiting)
        while running:
            (done, *_), _ = ray.wait(list(running))
            del running[done]
            sweep.save_trial(ray.get(done))
            if progress is not None:
                progress(total - len(running), total)
        summary, folder = sweep.write()
    finally:
        # a traceback would keep it alive, and with it the lock of the folder
        del sweep
        if own:
            ray.shutdown()
    return Summary(json.loads(summary), Path(folder))


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line."""
    parser = argparse.ArgumentParser("python -m manifactor.ray", description="Run an experiment on the workers of Ray.")
    parser.add_argument("config", help="the document that describes the experiment")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="set a value of the document")
    parser.add_argument("--data", metavar="DIR", help="the folder where public data sets lie; default: MANIFACTOR_DATA")
    parser.add_argument("--out", metavar="DIR", help="the folder for the results")
    parser.add_argument("--force", action="store_true", help="write into a folder that holds files of something else")
    parser.add_argument("--retry-failed", action="store_true", help="run the trials again that failed before")
    parser.add_argument("--address", help="of a cluster; default: one on this machine")
    parser.add_argument("--workers", type=int, metavar="N", help="workers on this machine; default: one for each processor")
    options = vars(parser.parse_args(arguments))

    def progress(done: int, of: int) -> None:
        print(f"{done} of {of} trials done", file=sys.stderr)

    try:
        summary = experiment(options.pop("config"), progress=progress, **options)
    except KeyboardInterrupt:
        print("interrupted: the same command goes on with the remaining trials", file=sys.stderr)
        return 130
    except (ManifactorError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 3 if isinstance(error, OSError) else 2
    print((summary.folder / "summary.md").read_text(encoding="utf-8"))
    print(f"Written to {summary.folder}.")
    return 0


if __name__ == "__main__":
    # workers import this module by name, and their own `__main__` lacks its definitions
    from manifactor.ray import main as command

    sys.exit(command())
