"""The results as Markdown tables, which are readable in a terminal too."""

import math

REACHES = 1e-4  # of the best known cost, relative


def best_known(measured):
    costs = [r.cost for r in measured.results if r.cost is not None]
    return min(costs + ([] if measured.best_known is None else [measured.best_known]), default=None)


def reaches(result, best):
    return None not in (result.cost, result.time, best) and result.cost <= best * (1.0 + REACHES)


def best_peer(measured):
    """Returns the fastest peer that reaches the best known cost, with any initialisation."""
    best = best_known(measured)
    reaching = [r for r in measured.results if not r.ours and reaches(r, best)]
    return min(reaching, key=lambda r: r.time, default=None)


def ratio(result, measured):
    """Returns the ratio to the best peer's time, or None if one of them does not reach the best known
    cost."""
    peer = best_peer(measured)
    return result.time / peer.time if peer and reaches(result, best_known(measured)) else None


def number(x, form, scale=1.0):
    return "" if x is None else format(scale * x, form)


def cost(result, best):
    """✗ marks a cost above the best known one."""
    return number(result.cost, ".9g") + ("" if reaches(result, best) else " ✗")


def milliseconds(result):
    """~ marks times for which most runs did not have a core to themselves."""
    return number(result.time, ".1f", 1e3) + (" ~" if result.disturbed > len(result.seconds) / 2 else "")


def table(head, rows):
    """The first column is left-aligned, all remaining columns are right-aligned."""
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def ending(result):
    """The termination, with the method's own cost if it minimises a different one."""
    differs = None not in (result.own_cost, result.cost) and abs(result.own_cost - result.cost) > 1e-5 * result.cost
    own = f"by its own account {result.own_cost:.9g}" if differs else ""
    return "; ".join(part for part in (result.status.replace("|", "/"), own) if part)


METHODS = ["method", "final cost", "iterations", "ms", "least ms", "MiB", "ratio", "stages in ms; how it ended"]


def of_method(result, measured):
    stages = ", ".join(f"{name} {1e3 * seconds:.1f}" for name, seconds in result.stages.items())
    return [
        f"**{result.method}**" if result.ours else result.method,
        cost(result, best_known(measured)),
        str(result.iterations) if result.seconds else "",
        milliseconds(result),
        number(min(result.seconds, default=None), ".1f", 1e3),
        number(result.memory_mib or None, ".0f"),
        number(ratio(result, measured), ".2f"),
        "; ".join(part for part in (stages, ending(result)) if part),
    ]


def of_problem(measured):
    """All methods on one problem: first those that reach the best known cost, then by time."""
    best = best_known(measured)
    order = sorted(measured.results, key=lambda r: (not reaches(r, best), r.time or math.inf))
    costs = f"Cost at the start {number(measured.start, '.9g')}, best known {number(best, '.12g')}."
    return f"### {measured.name}\n{costs}\n\n" + table(METHODS, [of_method(r, measured) for r in order])


SUMMARY = ["problem", "ours, ms", "cost", "best peer", "ms", "cost", "ours - theirs, relative", "ratio"]


def summary(all_measured, solver):
    """One row per problem: ours against the best peer."""
    rows = []
    for measured in all_measured:
        best, peer = best_known(measured), best_peer(measured)
        our = next((r for r in measured.results if r.ours and r.method.endswith(f" {solver}")), None)
        if our is None or measured.kind == "grid":
            continue
        excess = (our.cost - peer.cost) / peer.cost if peer and our.cost is not None else None
        rows.append([
            measured.name,
            milliseconds(our),
            cost(our, best),
            peer.method if peer else "none reaches it",
            milliseconds(peer) if peer else "",
            number(peer and peer.cost, ".9g"),
            number(excess, "+.1e"),
            number(ratio(our, measured), ".2f"),
        ])
    return f"Ours: `{solver}`.\n\n" + table(SUMMARY, rows) if rows else ""


def slope(points):
    """Slope of a line through the logarithms, by least squares."""
    if len(points) < 2:
        return None
    logs = [(math.log(x), math.log(y)) for x, y in points]
    mx, my = (sum(values) / len(logs) for values in zip(*logs))
    return sum((x - mx) * (y - my) for x, y in logs) / sum((x - mx) ** 2 for x, _ in logs)


def growth(all_measured, kind, unit):
    """Seconds and memory of each method on problems of one kind, and the exponents of their growth."""
    sizes = sorted((m for m in all_measured if m.kind == kind), key=lambda m: m.size)
    rows = {}
    for measured in sizes:
        for r in measured.results:
            rows.setdefault(r.method, {})[measured.size] = r
    lines = []
    for method, by_size in sorted(rows.items()):
        done = [(n, r) for n, r in by_size.items() if r.time and r.memory_mib]
        cells = []
        for n in (m.size for m in sizes):
            r = by_size.get(n)
            whole = r and r.time
            cells.append(f"{r.time:.3g} s, {r.memory_mib:.0f} MiB" if whole else r.status if r else "")
        slopes = [slope([(n, r.time) for n, r in done]), slope([(n, r.memory_mib) for n, r in done])]
        lines.append([method, *cells, *(number(x, ".2f") for x in slopes)])
    head = ["method", *(f"{m.size:,} {unit}" for m in sizes), "time grows as n^", "memory as n^"]
    return table(head, lines) if len(sizes) > 1 else ""
