"""Every start that is linked, as a function of its fields.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from typing import Literal

from .chosen import Start


__all__ = [
    "chordal",
    "given",
    "spanning_tree",
]


def chordal() -> Start:
    """Rotations from a linear relaxation of all relative measurements at once, then positions.

    Uses between factors and priors of rotations and poses, with any noise; robust losses are ignored. The
    rotation of a measurement is weighted by the mean variance of its three angles, independent of the
    translation. The positions then minimize the full cost with the rotations held. Held variables keep their
    values. A connected part without a held variable or prior keeps its first pose. Points are placed from
    their first measurement; other variables keep their values.

    The result is close to the optimum if rotations are measured well, independent of the given values. This
    start also marks a minimum as doubtful if the rotations along some loop add up to extra turns.

    ```toml
    start = { type = "chordal" }
    ```
    """
    return Start("chordal", {})


def given() -> Start:
    """The values from the graph's document, unchanged.

    ```toml
    start = { type = "given" }
    ```
    """
    return Start("given", {})


def spanning_tree(*, tree: Literal['chain', 'shallow'] | None = None) -> Start:
    """Variables placed one after another along a spanning tree of the between factors.

    Each connected part begins at its held variables, otherwise at a prior, otherwise at its first variable,
    which keeps its value. Points are placed from their first measurement; other variables keep their values.

    ```toml
    start = { type = "spanning_tree", tree = "shallow" }
    ```

    Args:
        tree: `chain` follows the odometry, if its factors come first. `shallow` uses as few factors as
            possible. Default: "chain".
    """
    return Start("spanning_tree", {"tree": tree})
