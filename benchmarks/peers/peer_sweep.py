"""Peers with other steps: what accuracy costs them, and when they step through a thin blade."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final

import numpy as np

import clench
from clench.core.pose import FloatArray, Pose
from clench.models.hand.hand import Hand
from clench.models.shapes import Shape, ShapeKind

from ..bench_report import Value, timed
from .closers import EXACT, OURS, SIMULATED, PeerCase
from .stepper import RULES, Closing, Rule, Stepper

#: The steppers' own steps and tolerances are multiplied by these.
FACTORS: Final = (8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125, 0.0625)
#: Poses per object at most, and how often each closing is timed.
_POSES: Final = 10
_REPEATS: Final = 3
#: Half of the blade's thickness, and radius of the fingers that meet it [m].
_BLADE: Final = "box:x=0.08,y=0.08,z=0.0001"
_WIRE: Final = 5e-4
#: A step that goes through neither, at 0.12 m from a joint [rad].
_SAFE: Final = 0.004
#: Beyond where a finger should have stopped by so much more than steps explain, it has gone through [rad].
_THROUGH: Final = 0.05
#: Turns that lead z to x, y and z.
_TURNS: Final = ((0.5**0.5, 0.0, 0.5**0.5, 0.0), (0.5**0.5, -(0.5**0.5), 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


@dataclass(frozen=True)
class Swept:
    """Median time of a closing [s] and median remaining gap [m]: for every factor of a rule, or for one way."""

    seconds: Mapping[str, list[float]]
    residual: Mapping[str, list[float]]


@dataclass(frozen=True)
class Misses:
    """The share of contacts with a blade that each rule steps through, for every factor.

    Args:
        shares: by rule. values: the reported values. errors: sentences about certified answers that miss.
    """

    shares: Mapping[str, list[float]]
    values: dict[str, Value] = field(default_factory=dict)
    errors: list[str] = field(default_factory=list)


def sweep(cases: Sequence[PeerCase], *, simulate: bool, advance: Callable[[], None]) -> Swept:
    """Close every case by every rule with all steps, by our own solve, and in MuJoCo."""
    seconds: dict[str, list[float]] = {}
    residual: dict[str, list[float]] = {}
    for rule in RULES:
        rows = [_measured(cases, rule.name, rule.scaled(factor)) for factor in FACTORS]
        seconds[rule.name], residual[rule.name] = ([row[column] for row in rows] for column in (0, 1))
    for name in (*OURS, SIMULATED) if simulate else OURS:
        both = _measured(cases, name, None)
        seconds[name], residual[name] = [both[0]], [both[1]]
    for name, full in OURS.items():
        shares = [min(timed(partial(c.solve_all, full))[1] for _ in range(_REPEATS)) / len(c.poses) for c in cases]
        seconds[f"{name}_batch"], residual[f"{name}_batch"] = [float(np.median(shares))], residual[name]
    for _ in cases:
        advance()
    return Swept(seconds, residual)


def _measured(cases: Sequence[PeerCase], name: str, rule: Rule | None) -> tuple[float, float]:
    """Return median time and median gap over all cases, of every closing the quickest of a few."""
    times, gaps = [], []
    repeats = 1 if name == SIMULATED else _REPEATS
    for case in cases:
        close = case.closers()[name] if rule is None else partial(case.step, rule)
        for k in range(min(_POSES, len(case.poses))):
            found = [timed(partial(close, k)) for _ in range(repeats)]
            times.append(min(seconds for _, seconds in found))
            ended = case.ended(k, found[0][0])
            gaps += [abs(gap) for finger, gap in case.gaps(k, ended.q).items() if finger in ended.touching]
    return float(np.median(times)), float(np.median(gaps or [0.0]))


def blade_misses(hand: Hand, count: int, seed: int, planes: int) -> Misses:
    """Close wire-thin fingers on a blade of 0.1 mm, in steps of several sizes and by our own solve.

    A touch is missed when steps that are too small to miss it find it, and the finger goes on through the blade.
    """
    wires, blade = with_wires(hand), clench.GraspObject.load(_BLADE)
    case = PeerCase(wires, blade, clench.approach_poses(wires, blade, min(count, _POSES), seed), planes)
    shares: dict[str, list[float]] = {}
    values: dict[str, Value] = {}
    for rule in RULES:
        safe = [case.stepper.close(rule.scaled(_SAFE / rule.step), T) for T in _places(case)]
        there = sum(touches for closing in safe for _, touches in case.stepper.fingers(closing))
        counts = [_missed(case, rule.scaled(factor), safe) for factor in FACTORS]
        shares[rule.name] = [missed / max(there, 1) for missed in counts]
        values |= {f"{rule.name}_touches": there, f"{rule.name}_missed": counts[FACTORS.index(1.0)]}
    errors = _our_misses(case, values)
    return Misses(shares, values, errors)


def with_wires(hand: Hand) -> Hand:
    """Return a hand whose fingers' links are wires of 1 mm as long as the shapes that they replace."""
    moving = {link for finger in hand.fingers for link in finger.links}
    links = []
    for i, link in enumerate(hand.links):
        shapes = {source: tuple(map(_wire, own)) for source, own in link.shapes.items()}
        links.append(replace(link, shapes=shapes) if i in moving else link)
    return replace(hand, links=tuple(links))


def _wire(shape: Shape) -> Shape:
    """Return a capsule along the longest side of the box around a shape."""
    vertices: FloatArray = shape.to_mesh(1e-4).vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    axis = int(np.argmax(high - low))
    half = max(0.5 * float((high - low)[axis]) - _WIRE, _WIRE)
    return Shape(ShapeKind.CAPSULE, (_WIRE, half, 0.0), Pose(0.5 * (low + high), wxyz=_TURNS[axis]))


def _places(case: PeerCase) -> list[FloatArray]:
    return [case.T_palm_object(k) for k in range(len(case.poses))]


def _missed(case: PeerCase, rule: Rule, safe: Sequence[Closing]) -> int:
    missed = 0
    for T, right in zip(_places(case), safe, strict=True):
        closing = case.stepper.close(rule, T)
        both = zip(case.stepper.fingers(closing), case.stepper.fingers(right), strict=True)
        for (finger, touches), (_, should) in both:
            through = beyond(case.stepper, finger.name, closing.q, right.q) > _THROUGH + 2.0 * rule.fine
            missed += should and (not touches or through)
    return missed


def beyond(stepper: Stepper, finger: str, q: FloatArray, right: FloatArray) -> float:
    """Return how much farther the first joint of a finger has closed than it should [rad]."""
    arrays = stepper.arrays
    number = [f.name for f in stepper.hand.fingers].index(finger)
    d = int(np.flatnonzero(arrays.finger == number)[0])
    return float((q - right)[arrays.free[d]] * arrays.rate[d])


def _our_misses(case: PeerCase, values: dict[str, Value]) -> list[str]:
    """Add how many touches our own solve misses; return sentences about certified answers that do."""
    errors = []
    fine = Rule("fine", 2, _SAFE, 1e-4)
    for name, full in OURS.items():
        missed = there = 0
        for k, T in enumerate(_places(case)):
            right = case.stepper.close(fine, T)
            solution = case.solve(full, k)
            ended = case.ended(k, solution)
            for finger, touches in case.stepper.fingers(right):
                there += touches
                past = beyond(case.stepper, finger.name, ended.q, right.q)
                missed += touches and (finger.name not in ended.touching or past > _THROUGH)
                if touches and past > EXACT and solution.certified:
                    errors.append(f"blade, pose {k}: our certified {finger.name} goes through it.")
        values |= {f"{name}_touches": there, f"{name}_missed": missed}
    return errors
