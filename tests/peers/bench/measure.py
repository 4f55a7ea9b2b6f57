"""Runs methods in turn, on one core, each in a separate process."""

import json
import os
import signal
import statistics
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path


# for libraries that count cores without the affinity
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1"}


@dataclass(frozen=True)
class Stop:
    """Stopping rule for all: a step that changes the cost by less than this fraction, or this number of
    iterations."""

    max_iterations: int = 100
    relative_cost: float = 1e-6


@dataclass
class Result:
    """Result of one method on one problem: seconds of each run; stages and everything else from the median
    run."""

    method: str
    ours: bool
    status: str = ""
    seconds: list[float] = field(default_factory=list)
    stages: dict[str, float] = field(default_factory=dict)
    iterations: int = 0
    memory_mib: float = 0.0
    cost: float | None = None  # by the referee
    own_cost: float | None = None  # by the method's own account
    disturbed: int = 0  # runs that had to share the core

    @property
    def time(self):
        """Returns the median of the seconds, or None if no run ended by itself."""
        return statistics.median(self.seconds) if self.seconds else None


def peak_kib(pid):
    """Returns the peak resident memory of a running process. wait4 would count the memory of its parent at
    the fork."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0
    return next((int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")), 0)


def watched(command, core, patience, log):
    """Runs a command on one core. Returns its exit status, its peak KiB, and the seconds that it waited for
    the core or for a file."""
    began = time.perf_counter()
    pinned = ["taskset", "--cpu-list", str(core), *map(str, command)]
    with open(log, "w") as out, open(f"{log}.err", "w") as err:
        process = subprocess.Popen(pinned, stdout=out, stderr=err, env=os.environ | ONE_THREAD)
        peak = 0
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                break
            peak = max(peak, peak_kib(process.pid))
            if time.perf_counter() - began > patience:
                os.kill(process.pid, signal.SIGKILL)  # process.kill would wait for it, and take its status
            time.sleep(0.002)
    process.returncode = os.waitstatus_to_exitcode(status)
    waited = time.perf_counter() - began - usage.ru_utime - usage.ru_stime
    return process.returncode, peak, waited


def report(log):
    """Returns the output of an adapter, or None if it is incomplete."""
    try:
        told = json.loads(Path(log).read_text())
    except ValueError:
        return None
    if "seconds" not in told:
        return None
    return of_command_line(told) if isinstance(told["seconds"], dict) else told


def of_command_line(told):
    """Converts the report of our own command line to the format of an adapter."""
    seconds, end = told["seconds"], told["termination"]
    start = told.get("start", {}).get("seconds", 0.0)
    stages = {"start": start} | {name: spent for name, spent in seconds.items() if name != "total"}
    return {
        "seconds": start + seconds["total"],
        "stages": {name: spent for name, spent in stages.items() if spent > 0.0},
        "iterations": told["iterations"],
        "status": end.get("reason") or end["status"],
        "own_cost": told["final_cost"],
    }


def last_words(log):
    """Returns the last line with a message in the output of a failed adapter."""
    lines = [line.strip() for line in Path(f"{log}.err").read_text().splitlines()]
    return next((line for line in reversed(lines) if line and not line.startswith("note:")), "nothing said")


def run_once(method, problem_input, folder, stop, core, patience):
    """Runs once. Returns its report with peak memory, or a text with the reason of its failure."""
    output, log = folder / f"estimate{problem_input.suffix}", folder / "report.json"
    output.unlink(missing_ok=True)
    code, peak, waited = watched(method.command(problem_input, output, stop), core, patience, log)
    told = report(log)
    if told is None:
        return f"stopped after {patience:.0f} s" if code == -9 else f"exit status {code}: {last_words(log)}"
    told["memory_mib"] = (peak - told.get("held_kib", 0)) / 1024.0
    told["disturbed"] = waited > 0.01 + 0.05 * told["seconds"]
    return told


def measure(methods, problem_input, folder, stop, core, repeat, patience):
    """Returns the results by method. Rounds go through all methods, so that a disturbance affects all of
    them."""
    runs = {method: [] for method in methods}
    results = {method: Result(method.name, method.ours) for method in methods}
    for round in range(repeat):
        for method in methods:
            result = results[method]
            # long runs are stable, and failures stay failures
            if round and (not runs[method] or result.seconds[0] > patience / 6.0):
                continue
            place = folder / method.folder
            place.mkdir(parents=True, exist_ok=True)
            told = run_once(method, problem_input, place, stop, core, patience)
            if isinstance(told, str):
                result.status = told
                continue
            runs[method].append(told)
            result.seconds.append(told["seconds"])
            result.disturbed += told["disturbed"]
    for method, result in results.items():
        if runs[method]:
            middle = sorted(runs[method], key=lambda told: told["seconds"])[(len(runs[method]) - 1) // 2]
            result.status, result.iterations = middle["status"], middle["iterations"]
            result.stages, result.own_cost = middle.get("stages", {}), middle.get("own_cost")
            result.memory_mib = max(0.0, max(told["memory_mib"] for told in runs[method]))
    return results

