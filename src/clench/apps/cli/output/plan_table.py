"""The table of planned grasps, on standard output."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from .tables import console_out, plain, print_table, table_with

#: Explanations of some columns.
_MEANINGS: Final = {
    "palm": "position of the palm link in the world",
    "epsilon": "the smallest wrench that the grasp does not resist, for forces that add up to 1 N",
    "confidence": "share of grasps with this score that held in simulation",
    "links": "number of links that touch",
    "torque": "the largest joint torque of the squeeze",
    "held": "result of the hold test",
}


def print_plan(document: Mapping[str, Any], text: str) -> None:
    """Print planned grasps, best first, and the fate of the other proposals; see `clench plan --json`."""
    console = console_out()
    columns = ["", "kind", "preshape", "palm [mm]", "epsilon", "confidence", "links", "torque [Nm]"]
    tried = any("hold" in grasp for grasp in document["grasps"])
    table = table_with(f"{document['hand']} on {document['object']}", *columns, *(["held"] if tried else []))
    for number, grasp in enumerate(document["grasps"], start=1):
        solution = grasp["solution"]
        place = " ".join(f"{1e3 * x:z.0f}" for x in solution["hand_pose"]["position"])
        links = sorted({contact["link"] for contact in solution["contacts"] if not contact["passed"]})
        torque = max((abs(t) for t in solution["squeeze"]["torques"].values()), default=0.0)
        row = [str(number), grasp["kind"], grasp["preshape"], place, f"{grasp['epsilon']:z.3f}"]
        sure = grasp["confidence"]
        row += ["" if sure is None else f"{100 * sure:z.0f} %", str(len(links))]
        row += [f"{torque:z.3f}", *(["yes" if grasp["hold"]["held"] else "no"] if tried else [])]
        table.add_row(*map(plain, row))
    print_table(console, table)
    meanings = _MEANINGS if tried else {name: said for name, said in _MEANINGS.items() if name != "held"}
    console.print(plain(". ".join(f"{name}: {said}" for name, said in meanings.items()) + "."))
    console.print(plain(text))
    fallen = {reason: n for reason, n in document["rejected"].items() if n}
    if fallen:
        most = sorted(fallen.items(), key=lambda item: -item[1])
        console.print("rejected: " + plain(", ".join(f"{n} {reason}" for reason, n in most)), soft_wrap=True)
    closed, closure = document["closed"], document["force_closed"]
    console.print(f"{closed} closed, {closure} of them resist every wrench; {document['seconds']['total']:z.2f} s")
