"""The documented commands, run as a user would, in a temporary folder."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
BASE = """
source = { type = "simulated", scene = { objects = 3 }, trajectory = { frames = 12 } }
odometry = { noise = { sigma = 0.005 } }
detections = { noise = { sigma = 5.0 } }
"""
SWEEP = """
title = "small"
base = "base.toml"
[[axes]]
columns = { seed = "source.seed" }
rows = [1, 2, 3]
[[axes]]
columns = { frames = "source.trajectory.frames" }
rows = [10, 12]
[summary]
by = ["frames"]
metrics = ["ate_se3"]
resamples = 50
"""
#: Files that contain durations.
TIMES = ("times.csv", "trials.jsonl")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "base.toml").write_text(BASE)
    (tmp_path / "sweep.toml").write_text(SWEEP)
    # neither the width of the terminal nor a folder of data matters
    monkeypatch.delenv("MANIFACTOR_DATA", raising=False)
    return tmp_path


def typed(command: str, folder: Path, **options: str) -> subprocess.CompletedProcess[str]:
    """Runs a command with this interpreter, whose scripts come first in the path."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    command = re.sub(r"^python\b", sys.executable, command)
    environment = {**os.environ, "PATH": path, **options}
    return subprocess.run(
        command, shell=True, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )


def files(folder: Path) -> dict[str, bytes]:
    found = {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    return {name: b"" if name in TIMES else content for name, content in found.items()}


def documented(start: str) -> str:
    """Returns a command from the page on Python."""
    page = " ".join((ROOT / "docs" / "python.md").read_text(encoding="utf-8").split())
    found: str
    (found,) = set(re.findall(rf"`({re.escape(start)}[^`]*)`", page))
    return found


def test_the_command_over_ray_leaves_the_files_of_a_local_one(folder: Path) -> None:
    pytest.importorskip("ray")
    command = documented("python -m manifactor.ray sweep.toml").removesuffix(" --address auto")
    over_ray = typed(f"{command} --out ray --workers 2", folder)
    assert over_ray.returncode == 0, over_ray.stderr
    assert "6 of 6 trials done" in over_ray.stderr and "Written to ray." in over_ray.stdout
    local = typed("manifactor experiment sweep.toml --out local", folder)
    assert local.returncode == 0, local.stderr
    here, there = files(folder / "local"), files(folder / "ray")
    assert here.keys() == there.keys() and {"report.html", "summary.md", "trials.parquet"} <= here.keys()
    assert any(name.endswith(".svg") for name in here) and any(name.endswith(".png") for name in here)
    assert [name for name in here if here[name] != there[name]] == []


def workers(parent: int) -> list[int]:
    """Returns the Ray processes below a driver that run a trial now."""
    parents: dict[int, int] = {}
    running: list[int] = []
    for process in Path("/proc").iterdir():
        if not process.name.isdigit():
            continue
        try:
            parents[int(process.name)] = int((process / "stat").read_text().rsplit(")", 1)[1].split()[1])
            if (process / "cmdline").read_text().startswith("ray::run_trial"):
                running.append(int(process.name))
        except OSError:
            continue

    def is_below(process: int) -> bool:
        while process and process != parent:
            process = parents.get(process, 0)
        return process == parent

    return [process for process in running if is_below(process)]


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system does not list processes in files")
def test_the_command_over_ray_survives_a_worker_that_is_killed(folder: Path) -> None:
    pytest.importorskip("ray")
    command = [sys.executable, "-m", "manifactor.ray", "sweep.toml", "--out", "ray", "--workers", "2"]
    driver = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    killed: list[int] = []

    def kill() -> None:
        while driver.poll() is None and not killed:
            for worker in workers(driver.pid)[:1]:
                os.kill(worker, signal.SIGKILL)
                killed.append(worker)
            time.sleep(0.001)

    killer = threading.Thread(target=kill)
    killer.start()
    out, error = driver.communicate(timeout=300)
    killer.join()
    assert driver.returncode == 0, error
    assert len(killed) == 1 and "6 of 6 trials done" in error
    assert typed("manifactor experiment sweep.toml --out local", folder).returncode == 0
    assert files(folder / "ray") == files(folder / "local")


def test_parts_of_a_command_are_merged(folder: Path) -> None:
    part = documented("manifactor experiment sweep.toml --shard")
    for number in range(1, 9):
        made = typed(f"{part} --out parts", folder, SLURM_ARRAY_TASK_ID=str(number))
        assert made.returncode == 0, made.stderr
    assert typed("manifactor experiment sweep.toml --out parts", folder).returncode == 0
    assert typed("manifactor experiment sweep.toml --out local", folder).returncode == 0
    parts, local = files(folder / "parts"), files(folder / "local")
    assert {name: parts[name] for name in local} == local


@pytest.mark.parametrize(
    ("command", "code", "message"),
    [
        ("python -m manifactor.ray missing.toml", 3, "missing.toml: cannot be read"),
        ("python -m manifactor.ray bad.toml", 2, "bad.toml:1:"),
        ("python -m manifactor.ray", 2, "config"),
        ("python -m manifactor.ray sweep.toml --out taken", 3, "taken"),
        ("python -m manifactor missing", 2, "missing"),
        ("manifactor solve missing.toml", 3, "missing.toml"),
    ],
)
def test_a_command_that_fails_says_why_without_a_traceback(folder: Path, command: str, code: int, message: str) -> None:
    if "manifactor.ray" in command:
        pytest.importorskip("ray")
    (folder / "bad.toml").write_text("title =")
    (folder / "taken").write_text("a file")
    ended = typed(command, folder)
    assert (ended.returncode, "Traceback" in ended.stderr) == (code, False), ended.stderr
    assert message in ended.stderr
