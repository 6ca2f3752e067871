"""The command that fits weights to examples."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from clench.core.exceptions import CommandError

if TYPE_CHECKING:
    from clench.scoring.fitting import Fit

SCHEMA = "clench.calibrate/1"


def calibrate(
    examples: Path | None = None,
    /,
    *,
    record: Path | None = None,
    base: str = "balanced",
    out: Path | None = None,
    json: bool = False,
) -> int:
    """Fit the weights of the criteria to examples: pairs better and worse, and outcomes held or dropped.

    Args:
        examples: examples file (JSON), see docs/calibration.md.
        record: SQLite record whose noted outcomes count, too.
        base: preset or calibration file that gives scales and limits, and that the fit is compared with.
        out: calibration file (TOML) to write.
        json: print one JSON document on standard output.
    """
    from dataclasses import replace

    import numpy as np

    from clench.apps.cli.output.printing import print_files
    from clench.apps.cli.output.results import print_json
    from clench.core.files.json_files import check_writable, write_atomically
    from clench.scoring.calibration import calibration_of, calibration_to_toml
    from clench.scoring.fitting import fit_weights, told_right
    from clench.solver.analysis.examples import ScoredExamples, read_examples, recorded_outcomes

    if out is not None:
        check_writable(out)
    if examples is None and record is None:
        raise CommandError("calibrate: expected an examples file, or --record with noted outcomes.")
    scored = ScoredExamples([], [])
    if examples is not None:
        scored += read_examples(examples)
    if record is not None:
        scored += recorded_outcomes(record)
    before = calibration_of(base)
    numbers = scored.in_numbers(before)
    fit = fit_weights(numbers, source=" and ".join(str(path) for path in (examples, record) if path is not None))
    known = np.array([before.weights.get(name, 0.0) for name in fit.names])
    compared = told_right(numbers, known, None) if fit.pairs else None
    fitted = replace(before, weights=dict(zip(fit.names, fit.weights.round(6).tolist(), strict=True)))
    if out is not None:
        write_atomically(out, calibration_to_toml(fitted, {"": _sentence(fit)}).encode())
    if json:
        print_json(_document(fit, before.name, compared))
        return 0
    _print(fit, before.name, compared)
    print_files([] if out is None else [out])
    return 0


def _sentence(fit: Fit) -> str:
    return (
        f"Fitted to {fit.pairs} pairs and {fit.outcomes} outcomes; tells {fit.held_out:.0%} of those right that were "
        f"left out of the fit in turn ({fit.folds} parts), {fit.accuracy:.0%} of all."
    )


def _document(fit: Fit, base: str, compared: float | None) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "weights": dict(zip(fit.names, fit.weights.tolist(), strict=True)),
        "accuracy": fit.accuracy,
        "held_out_accuracy": fit.held_out,
        "folds": fit.folds,
        "pairs": fit.pairs,
        "outcomes": fit.outcomes,
        "base": base,
        "base_accuracy_on_pairs": compared,
    }


def _print(fit: Fit, base: str, compared: float | None) -> None:
    from clench.apps.cli.output.printing import print_weights

    print_weights(dict(zip(fit.names, fit.weights.tolist(), strict=True)), _sentence(fit))
    if compared is not None:
        print_weights({}, f"'{base}' tells {compared:.0%} of the pairs right.")
