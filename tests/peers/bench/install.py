"""Peers, by the packages that they have. Whatever cannot be had is left out, and said."""

import os
import subprocess
import sys
import venv
from pathlib import Path

from bench.methods import Method, Ours

HERE = Path(__file__).resolve().parent.parent
ROOT = HERE.parent.parent
PYTHON_PACKAGES = ["numpy", "gtsam", "g2opy"]


def say(text):
    print(text, file=sys.stderr)


def call(command, **options):
    """Runs a command quietly; its last lines, where it fails."""
    ran = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    return None if ran.returncode == 0 else "\n".join(ran.stdout.splitlines()[-15:])


def python(cache):
    """The interpreter of a virtual environment with all Python packages."""
    folder = cache / "venv"
    interpreter = folder / "bin" / "python"
    if not interpreter.exists():
        venv.create(folder, with_pip=True)
    for package in PYTHON_PACKAGES:
        present = call([interpreter, "-c", f"import {package}"]) is None
        failed = None if present else call([interpreter, "-m", "pip", "install", "--quiet", package])
        if failed:
            say(f"{package}: left out, pip failed:\n{failed}")
    return interpreter


def ours(binary):
    """The release build of this tree, or the binary given."""
    if binary is None:
        failed = call(["cargo", "build", "--release", "--package", "manifactor-cli"], cwd=ROOT)
        if failed:
            sys.exit(f"building ours failed:\n{failed}")
        binary = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "manifactor"
    return Ours(binary)


def our_methods(ours, solvers, interpreter):
    adapter = (str(interpreter), str(HERE / "adapters" / "manifactor_solve.py"), ours.binary)
    return [Method("manifactor", solver, adapter, ours=True) for solver in solvers]


def gtsam(interpreter):
    if call([interpreter, "-c", "import gtsam"]):
        return []
    adapter = (str(interpreter), str(HERE / "adapters" / "gtsam_pose_graph.py"))
    return [Method("gtsam", method, adapter) for method in ("gn", "lm", "chordal+gn", "chordal+lm")]


def peers(cache, interpreter):
    return gtsam(interpreter)
