"""The card that says in words and numbers what became of a closing, as HTML for light and dark pages."""

from __future__ import annotations

from html import escape
from typing import Final

from clench.apps.viewer.session.quick_answer import QuickAnswer
from clench.apps.viewer.session.settled_answer import SettledAnswer

#: Colour, sign and words of every status; signs and words tell them apart without colours.
_STATUS: Final = {
    "grasp": ("#0b7a53", "✓", "Grasp"),
    "partial": ("#a45c00", "◐", "Partial grasp"),
    "no_contact": ("#56616c", "○", "No contact"),
    "blocked": ("#9d1f3a", "✕", "Blocked"),
}
_FINGER: Final = {
    "touch": ("●", "touches"),
    "limit": ("○", "at its limits"),
    "blocked": ("✕", "blocked"),
    "no_motion": ("–", "does not move"),
    "missed": ("○", "misses"),
}
_ALERT: Final = "#9d1f3a"
_BOX: Final = "padding:0.1em 0.9em 0.7em;font-size:0.86em;line-height:1.5"


def busy_card(sentence: str) -> str:
    """Return the card that says what takes a while."""
    return f'<div style="{_BOX}" data-clench="busy">{_pill("#2c5f8a", "…", "Working")}{_line(sentence)}</div>'


def failed_card(sentence: str) -> str:
    """Return the card that says what went wrong; the hand stays where it was."""
    return f'<div style="{_BOX}" data-clench="failed">{_pill(_ALERT, "!", "Not solved")}{_line(sentence)}</div>'


def answer_card(quick: QuickAnswer, settled: SettledAnswer | None, note: str = "") -> str:
    """Return the card of an answer.

    Args:
        quick: the answer while dragging. settled: the exact numbers of the same answer, None while they are not
            known. note: a sentence to add.
    """
    color, sign, word = _STATUS[quick.status]
    proof = "certified" if quick.certified else "not certified"
    text = "" if settled is None else str(settled.solution.reason.get("text", ""))
    rows = [
        ("Hold margin", _margin(quick, settled)),
        ("Holds the weight", "" if settled is None else _weight(settled)),
        ("Contacts", str(len(quick.links))),
        ("Solved in", f"{1e3 * quick.seconds:z.1f} ms"),
    ]
    shown = "".join(
        f'<tr><td style="opacity:0.72;padding-right:1em;vertical-align:top;white-space:nowrap">{name}</td>'
        f'<td style="font-variant-numeric:tabular-nums">{escape(value)}</td></tr>'
        for name, value in rows
        if value
    )
    state = "moving" if settled is None else "rest"
    return (
        f'<div style="{_BOX}" data-clench="{state}" data-status="{quick.status}">{_pill(color, sign, word)}'
        f'<span style="opacity:0.72;margin-left:0.6em">{proof}</span>{_line(text)}'
        f'<table style="border-spacing:0;margin:0.2em 0 0.4em">{shown}</table>{_fingers(quick)}{_note(note)}</div>'
    )


def _margin(quick: QuickAnswer, settled: SettledAnswer | None) -> str:
    if settled is None:
        return f"≥ {quick.bound:z.3f}" if quick.bound > 0.0 else "not shown to hold (bound)"
    if settled.quality is None:
        return "none"
    radius = settled.quality.epsilon.radius
    return f"{radius:z.3f}" if radius > 0.0 else "0: not every push is resisted"


def _weight(settled: SettledAnswer) -> str:
    if settled.squeeze is None:
        return settled.problem
    return settled.squeeze.text


def _fingers(quick: QuickAnswer) -> str:
    cells = []
    for name, status in quick.fingers.items():
        sign, word = _FINGER[status]
        weight = "600" if status == "touch" else "400"
        cells.append(
            f'<span title="{escape(name)} {word}" style="white-space:nowrap;font-weight:{weight}">'
            f"{sign}&nbsp;{escape(name)}</span>"
        )
    return f'<div style="display:flex;flex-wrap:wrap;gap:0.1em 0.9em">{"".join(cells)}</div>'


def _note(text: str) -> str:
    if not text:
        return ""
    return f'<div style="border-left:3px solid #a45c00;padding-left:0.6em;margin-top:0.5em">{escape(text)}</div>'


def _pill(color: str, sign: str, word: str) -> str:
    return (
        f'<span style="background:{color};color:#fff;border-radius:1em;padding:0.15em 0.8em;font-weight:600">'
        f"{sign}&ensp;{word}</span>"
    )


def _line(text: str) -> str:
    return f'<div style="margin:0.45em 0 0.25em">{escape(text)}</div>' if text else ""
