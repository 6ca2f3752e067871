"""Fit weights of criteria to examples: pairs "this one rather than that one", and outcomes held or dropped.

Pairs follow the model of Bradley and Terry (1952). The better one wins with probability 1 / (1 + exp(-w·d)). Here d is
the difference of the criteria's values, signed so that more is better and divided by their scales. An outcome is held
with probability 1 / (1 + exp(-(w·x + b))). Weights are at least 0: directions are known.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray

#: Half the sum of squared weights counts this much: it keeps weights finite where examples can be parted [-].
PENALTY: Final = 0.01
#: Parts of the examples that are left out in turn to measure accuracy.
FOLDS: Final = 5
FEWEST: Final = 4
_SEED: Final = 0


@dataclass(frozen=True, eq=False)
class Examples:
    """Examples as numbers, one column per criterion, signed and scaled.

    Args:
        names: of the criteria, M. better, worse: the two sides of every pair, shape (P, M) each.
        outcomes: scores of executed solves, shape (K, M). held: whether each was held, shape (K,).
    """

    names: tuple[str, ...]
    better: FloatArray
    worse: FloatArray
    outcomes: FloatArray
    held: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """Number of examples."""
        return len(self.better) + len(self.outcomes)

    def part(self, chosen: NDArray[np.bool_]) -> Examples:
        """Return some of the examples: pairs first, then outcomes, shape (count,)."""
        pairs, rest = chosen[: len(self.better)], chosen[len(self.better) :]
        return Examples(self.names, self.better[pairs], self.worse[pairs], self.outcomes[rest], self.held[rest])


@dataclass(frozen=True, eq=False)
class Fit:
    """The fitted weights and the quality of the fit.

    Args:
        names: of the criteria. weights: at least 0, the largest is 1, shape (M,).
        accuracy: share of the examples that are told right. held_out: the same for examples that were left out of
            the fit, in `folds` parts in turn. pairs, outcomes: how many examples of each kind.
    """

    names: tuple[str, ...]
    weights: FloatArray
    accuracy: float
    held_out: float
    folds: int
    pairs: int
    outcomes: int


def fit_weights(examples: Examples, penalty: float = PENALTY, *, source: str = "examples") -> Fit:
    """Return the weights that make the examples likeliest, and their accuracy on examples that were left out.

    Args:
        examples: at least four. penalty: see `PENALTY`. source: origin of the examples, for errors.

    Raises:
        CommandError: too few examples, equal outcomes only, no criterion that all examples have, or no criterion that
            separates better from worse in its own direction.
    """
    if examples.count < FEWEST:
        raise CommandError(f"{source}: expected at least {FEWEST} pairs and outcomes, got {examples.count}.")
    if not examples.names:
        raise CommandError(f"{source}: no criterion has a score on every side of every example.")
    if _one_kind(examples.held):
        what, other = ("held", "dropped") if examples.held[0] else ("dropped", "held")
        raise CommandError(
            f"{source}: all {len(examples.held)} outcomes are {what}, which does not tell what makes grasps hold; "
            f"add some that were {other}, or give pairs alone."
        )
    raw, intercept = likeliest(examples, penalty)
    if raw.max(initial=0.0) <= 0.0:
        listed = ", ".join(examples.names)
        raise CommandError(f"{source}: no criterion ({listed}) tells better from worse in its own direction.")
    folds = min(FOLDS, examples.count)
    fold = np.random.default_rng(_SEED).permutation(examples.count) % folds
    told = 0.0
    for k in range(folds):
        left_out = examples.part(fold == k)
        told += told_right(left_out, *likeliest(examples.part(fold != k), penalty)) * left_out.count
    return Fit(
        examples.names,
        raw / raw.max(),
        told_right(examples, raw, intercept),
        told / examples.count,
        folds,
        len(examples.better),
        len(examples.outcomes),
    )


def likeliest(examples: Examples, penalty: float) -> tuple[FloatArray, float]:
    """Return the likeliest weights, as fitted, shape (M,), and the intercept of the outcomes.

    Outcomes that are all the same say nothing about weights: their intercept is infinite, and pairs alone are fitted.
    """
    from scipy.optimize import minimize

    if _one_kind(examples.held):
        pairs = replace(examples, outcomes=examples.outcomes[:0], held=examples.held[:0])
        return likeliest(pairs, penalty)[0], np.inf if examples.held[0] else -np.inf
    size = len(examples.names)
    signs = np.where(examples.held, 1.0, -1.0)
    rows = np.vstack(
        [
            np.column_stack([examples.better - examples.worse, np.zeros(len(examples.better))]),
            np.column_stack([examples.outcomes, np.ones(len(examples.outcomes))]) * signs[:, None],
        ]
    )

    def loss(x: FloatArray) -> tuple[float, FloatArray]:
        margin = rows @ x
        wrong = 0.5 * (1.0 - np.tanh(0.5 * margin))  # 1 / (1 + exp(margin)) without overflow
        gradient = -wrong @ rows
        gradient[:size] += penalty * x[:size]
        return float(np.logaddexp(0.0, -margin).sum() + 0.5 * penalty * x[:size] @ x[:size]), gradient

    bounds = [(0.0, None)] * size + [(None, None)]
    found = minimize(loss, np.zeros(size + 1), jac=True, bounds=bounds, method="L-BFGS-B", options={"ftol": 1e-14})
    return np.asarray(found.x)[:size], float(found.x[size])


def told_right(examples: Examples, weights: FloatArray, intercept: float | None) -> float:
    """Return the share of examples that weights tell right; ties count half; no intercept leaves outcomes out."""
    right = [np.sign((examples.better - examples.worse) @ weights) / 2.0 + 0.5]
    if intercept is not None:
        said = np.sign(examples.outcomes @ weights + intercept)
        right.append(said * np.where(examples.held, 1.0, -1.0) / 2.0 + 0.5)
    each = np.concatenate(right)
    return float(each.mean()) if len(each) else 0.0


def _one_kind(held: NDArray[np.bool_]) -> bool:
    """Say whether there are outcomes, and all of them are the same."""
    return len(held) > 0 and bool(held.all() or not held.any())
