"""Criteria that choose among grasps: calibrations, and criteria of your own (docs/calibration.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clench.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from clench.scoring.calibration import Calibration, load_calibration
    from clench.scoring.criterion_registry import register_criterion
    from clench.scoring.criterion_types import Criterion, HandCriterion

_HOMES = {
    "Calibration": "clench.scoring.calibration",
    "Criterion": "clench.scoring.criterion_types",
    "HandCriterion": "clench.scoring.criterion_types",
    "load_calibration": "clench.scoring.calibration",
    "register_criterion": "clench.scoring.criterion_registry",
}

__all__ = [
    "Calibration",
    "Criterion",
    "HandCriterion",
    "load_calibration",
    "register_criterion",
]

__getattr__, __dir__ = lazy_names(__name__, _HOMES)
