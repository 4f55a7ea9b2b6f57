"""Ours, as its command line solves: METHOD is a solver's name. The time is what the report calls total.

    manifactor_solve.py BINARY METHOD INPUT OUTPUT MAX_ITERATIONS RELATIVE_COST

This process becomes that of the binary, so that its memory is measured and not ours; the runner reads its report.
"""

import os
import sys

binary, method, source, output, iterations, relative_cost = sys.argv[1:]
stop = {"max_iterations": iterations, "relative_cost": relative_cost}
settings = [word for key, value in stop.items() for word in ("--set", f"solver.stop.{key}={value}")]
os.execv(binary, [binary, "solve", source, "--json", "--out", output, "--solver", method, *settings])
