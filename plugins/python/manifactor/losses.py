"""Every loss that is linked, as a function of its fields.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from .chosen import Loss, Number


__all__ = [
    "cauchy",
    "constraint",
    "dcs",
    "fair",
    "geman_mcclure",
    "huber",
    "l1",
    "l2",
    "tempered",
    "tukey",
    "welsch",
]


def cauchy(*, scale: Number | None = None) -> Loss:
    """Grows with the logarithm: ρ = k² ln(1 + s/k²).

    ```toml
    loss = { type = "cauchy", scale = 1.0 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's unless the text says otherwise. Default: 1.0.
    """
    return Loss("cauchy", {"scale": scale})


def constraint() -> Loss:
    """An equality constraint: the residual has to be zero. Its noise gives the unit in which a violation is measured.

    A solve minimizes the cost of the other factors subject to all constraints, by the method of multipliers, and the
    outcome has the multipliers. A constraint has to be possible: one between two fixed variables, or two that
    contradict each other, end the solve without a result.

    ```toml
    loss = { type = "constraint" }
    ```
    """
    return Loss("constraint", {})


def dcs(*, scale: Number | None = None) -> Loss:
    """Dynamic covariance scaling: squares up to s = k, weight (2k/(k + s))² beyond.

    Unlike in the other losses, the scale Φ = k is in units of s, i.e. squared σ's (Agarwal et al., ICRA
    2013, eq. 15). The paper gives only a weight. The cost is its integral: ρ = k (3s - k)/(k + s)
    beyond k, which saturates at 3k.

    ```toml
    loss = { type = "dcs", scale = 1.0 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's unless the text says otherwise. Default: 1.0.
    """
    return Loss("dcs", {"scale": scale})


def fair(*, scale: Number | None = None) -> Loss:
    """Between squares and the norm: ρ = 2k² (√s/k - ln(1 + √s/k)).

    ```toml
    loss = { type = "fair", scale = 1.4 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's unless the text says otherwise. Default: 1.4.
    """
    return Loss("fair", {"scale": scale})


def geman_mcclure(*, scale: Number | None = None) -> Loss:
    """Saturates at k²: ρ = k² s / (k² + s).

    ```toml
    loss = { type = "geman_mcclure", scale = 1.0 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's unless the text says otherwise. Default: 1.0.
    """
    return Loss("geman_mcclure", {"scale": scale})


def huber(*, scale: Number | None = None) -> Loss:
    """Squares up to the scale k, linear beyond: ρ = s for √s ≤ k, 2k√s - k² beyond.

    ```toml
    loss = { type = "huber", scale = 1.345 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's unless the text says otherwise. Default: 1.345.
    """
    return Loss("huber", {"scale": scale})


def l1(*, scale: Number | None = None) -> Loss:
    """The norm instead of its square: ρ = 2k√s.

    The scale is the slope: half the cost of one more σ. The weight k/√s has no bound; below √s = 1e-6 k
    the loss continues as a parabola with the slope at that point.

    ```toml
    loss = { type = "l1" }
    ```

    Args:
        scale: The scale k of the formula above, in σ's unless the text says otherwise. Default: 1.0.
    """
    return Loss("l1", {"scale": scale})


def l2() -> Loss:
    """No robustness: ρ = s. Equivalent to no loss.

    ```toml
    loss = { type = "l2" }
    ```
    """
    return Loss("l2", {})


def tempered(*, tau: Number, loss: Loss) -> Loss:
    """A loss at a different temperature: ρ(τs)/τ.

    If τ residuals of a kind carry the information of one, their σ is multiplied by √τ. This loss still
    counts in the σ of a single residual: an outlier is one among single residuals, not among means of τ of
    them. Small residuals cost as much as without the loss. The built-in losses need no wrapper, which is
    cheaper: use `scale` / √τ, or `scale` / τ for `dcs`.

    ```toml
    loss = { type = "tempered", tau = 4.0, loss = { type = "huber", scale = 1.345 } }
    ```

    Args:
        tau: τ: the number of residuals that carry the information of one.
        loss: The loss ρ.
    """
    return Loss("tempered", {"tau": tau, "loss": loss})


def tukey(*, scale: Number | None = None) -> Loss:
    """Ignores residuals beyond the scale: ρ = k²/3 (1 - (1 - s/k²)³) up to √s = k, k²/3 beyond.

    ```toml
    loss = { type = "tukey", scale = 4.685 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's unless the text says otherwise. Default: 4.685.
    """
    return Loss("tukey", {"scale": scale})


def welsch(*, scale: Number | None = None) -> Loss:
    """Saturates at k², faster: ρ = k² (1 - exp(-s/k²)).

    ```toml
    loss = { type = "welsch", scale = 2.985 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's unless the text says otherwise. Default: 2.985.
    """
    return Loss("welsch", {"scale": scale})
