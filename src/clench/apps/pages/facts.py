"""Write the words and numbers of a page: HTML in which every text from files is escaped."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np

from clench.core.showing.visible_text import visible
from clench.models.hand.hand import Hand
from clench.planner.grasp_plan import PlannedGrasp
from clench.solver.solution import GraspSolution

#: Statuses in words.
_WORDS: Final = {"grasp": "grasp", "partial": "partial grasp", "no_contact": "no contact", "blocked": "blocked"}


def text(value: object) -> str:
    """Return a value as text of a page: nothing in it is read as HTML, and codes in it are written out."""
    return html.escape(visible(str(value)))


def status(solution: GraspSolution) -> str:
    """Return the status as a coloured word."""
    value = solution.status.value
    return f'<span class="status {text(value)}">{text(_WORDS.get(value, value))}</span>'


def solution_facts(solution: GraspSolution, motion: str, planned: PlannedGrasp | None = None) -> str:
    """Return status, reason, numbers, certificate and tables of a solution.

    Args:
        solution: the shown solution. motion: a sentence about the animation. planned: the planned grasp, or None.
    """
    parts = [
        f"<h1>{text(solution.hand)} on {text(solution.object)}</h1>",
        f"<p>{status(solution)} {text(solution.reason.get('text', ''))}</p>",
        _pairs(_numbers(solution, planned)),
        f"<p>{text(motion)}</p>",
        *(f'<p class="no">{text(sentence)}</p>' for sentence in solution.violations()),
        "<h2>Certificate</h2>",
        _certificate(solution),
        "<h2>Contacts</h2>",
        contact_table(solution),
        "<h2>Fingers</h2>",
        _table(("finger", "ends with", "why"), ((n, f.status.value, f.reason) for n, f in solution.fingers.items())),
        *_choice(solution),
        *_squeeze(solution),
        "<details><summary>Joint angles</summary>",
        _joints(solution),
        "</details>",
    ]
    return "\n".join(parts)


def contact_table(solution: GraspSolution) -> str:
    """Return a row for every contact: number, link, kind, gap, place and normal."""
    if not solution.contacts:
        return "<p>No link touches.</p>"
    heads = ("", "finger", "link", "kind", "gap [m]", "x, y, z [mm]", "normal")
    rows = []
    for k, c in enumerate(solution.contacts):
        place = ", ".join(f"{1e3 * x:z.1f}" for x in c.position)
        normal = ", ".join(f"{x:z.2f}" for x in c.normal)
        kind = f"{c.kind.value}{', opened again' if c.passed else ''}"
        cells = (k + 1, c.finger, c.link, kind, f"{c.gap:.1e}", place, normal)
        rows.append(f'<tr data-contact="{k}">{"".join(f"<td>{text(cell)}</td>" for cell in cells)}</tr>')
    return _framed(heads, rows)


def hand_facts(hand: Hand) -> str:
    """Return the fingers of a hand with their joints and limits."""
    rows = []
    for finger in hand.fingers:
        for j in finger.joints:
            joint = hand.joints[j]
            span = " to ".join(f"{np.rad2deg(x):z.0f}" for x in (joint.lower, joint.upper))
            rows.append((finger.name, joint.name, joint.role.value, f"{np.rad2deg(joint.open_value):z.0f}", span))
    closing = sum(row[2] == "closing" for row in rows)
    numbers = (("fingers", len(hand.fingers)), ("joints", len(hand.joints)), ("closing joints", closing))
    return "\n".join(
        [
            f"<h1>{text(hand.name)}</h1>",
            _pairs((*numbers, ("palm", hand.links[hand.palm].name))),
            "<p>The fingers close from open to their limits, all joints in step.</p>",
            "<h2>Joints</h2>",
            _table(("finger", "joint", "role", "open [deg]", "limits [deg]"), rows),
            *(f"<p>{text(warning)}</p>" for warning in hand.warnings),
        ]
    )


def _numbers(solution: GraspSolution, planned: PlannedGrasp | None) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    if planned is not None:
        found += [("kind", planned.kind.value), ("preshape", planned.preshape)]
        found += [("epsilon", f"{planned.epsilon:z.4f}"), ("score", f"{planned.score:z.4f}")]
        if planned.confidence is not None:
            share = f"{100 * planned.confidence:z.0f} %"
            found.append(("confidence", f"{share} of grasps with such a score held in simulation"))
    elif solution.quality is not None:
        found.append(("epsilon", f"{solution.quality['epsilon']:z.4f}"))
    gaps = [c.gap for c in solution.contacts if not c.passed]
    found.append(("contacts", len(gaps)))
    if gaps:
        found.append(("largest gap", f"{max(gaps):.1e} m"))
    if solution.max_penetration is not None:
        found.append(("largest penetration", f"{1e3 * solution.max_penetration:z.4f} mm"))
    place = ", ".join(f"{1e3 * x:z.1f}" for x in solution.hand_pose.position)
    turn = ", ".join(f"{x:z.4f}" for x in solution.hand_pose.wxyz)
    found += [("palm at", f"[{place}] mm"), ("palm turned", f"[{turn}] wxyz")]
    geometry = f"hand {solution.collision_source}, object {solution.object_collision_source}"
    found.append(("geometry", geometry))
    if "total" in solution.timing:
        found.append(("computed in", f"{1e3 * solution.timing['total']:z.2f} ms"))
    return found


def _certificate(solution: GraspSolution) -> str:
    word, kind = ("✓ certified", "yes") if solution.certified else ("✗ not certified", "no")
    said = "" if solution.certificate is None else str(solution.certificate.get("text", ""))
    return f'<p><strong class="{kind}">{word}</strong> {text(said)}</p>'


def _choice(solution: GraspSolution) -> list[str]:
    said = (solution.choice or {}).get("text")
    return ["<h2>Why this grasp</h2>", f"<p>{text(said)}</p>"] if said else []


def _squeeze(solution: GraspSolution) -> list[str]:
    squeeze = solution.squeeze or {}
    if not squeeze.get("text"):
        return []
    rows = [
        (contact["finger"], contact["link"], f"{float(np.linalg.norm(force)):z.2f}")
        for contact, force in zip(squeeze.get("contacts", ()), squeeze.get("forces", ()), strict=False)
    ]
    table = [_table(("finger", "link", "force [N]"), rows)] if rows else []
    return ["<h2>Squeeze</h2>", f"<p>{text(squeeze['text'])}</p>", *table]


def _joints(solution: GraspSolution) -> str:
    rows = (
        (name, f"{np.rad2deg(solution.open_angles.get(name, np.nan)):z.2f}", f"{np.rad2deg(angle):z.2f}")
        for name, angle in solution.joint_angles.items()
    )
    return _table(("joint", "open [deg]", "closed [deg]"), rows)


def _pairs(pairs: Iterable[tuple[str, Any]]) -> str:
    return f"<dl>{''.join(f'<dt>{text(name)}</dt><dd>{text(value)}</dd>' for name, value in pairs)}</dl>"


def _table(heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    return _framed(heads, [f"<tr>{''.join(f'<td>{text(cell)}</td>' for cell in row)}</tr>" for row in rows])


def _framed(heads: Sequence[str], rows: Sequence[str]) -> str:
    head = "".join(f"<th>{text(name)}</th>" for name in heads)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table></div>'
