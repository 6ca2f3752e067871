"""Tables for people: every column of numbers names its unit."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import clench
from clench.apps.cli.output import choice_tables, printing
from clench.apps.cli.output.plan_table import print_plan
from clench.models.hand.hand_report import describe_hand

if TYPE_CHECKING:
    from rich.table import Table

APPS = Path(clench.__file__).parent / "apps"
#: Heads of columns whose numbers count or name something.
COUNTS = {
    *("", "id", "seed", "touching", "posture", "step", "poses", "share", "set"),
    *("thumb", "index", "middle", "ring", "little"),
}
NUMBER = re.compile(r"[±+-]?\d[\d.e+-]*")


@pytest.fixture(scope="module")
def shown() -> list[Table]:
    """All tables that solving, batching, executing and recording print."""
    tables: list[Table] = []
    patch = pytest.MonkeyPatch()

    def noted(title: str, *columns: str) -> Table:
        from clench.apps.cli.output.tables import table_with

        tables.append(table_with(title, *columns))
        return tables[-1]

    patch.setattr(printing, "table_with", noted)
    patch.setattr(choice_tables, "table_with", noted)
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    pose = clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])
    orders = (clench.ClosingOrder.PROXIMAL_FIRST, clench.ClosingOrder.FINGERTIP)
    command = clench.GraspCommand(pose, orders=orders, criteria={"range_of_motion": 1.0, "limit_distance": 0.2})
    solution = clench.complete(clench.solve(hand, mug, command), hand, mug)
    printing.print_solution(solution, [], [])
    printing.print_forces(solution)
    choice_tables.print_choice(solution)
    printing.print_pose_error(clench.pose_error(hand, mug, pose))
    printing.print_hand(describe_hand(hand, ()))
    printing.print_report(clench.execute(solution, clench.SimulatedHand(hand, mug, hold=clench.Hold())))
    batch = clench.solve_batch(hand, mug, [pose])
    document = {"hand": "h", "object": "o", "poses": 1, "seconds": 1.0, "status": batch.counts()}
    printing.print_batch({**document, "certified": 1})
    printing.print_weights({"steadiness": 0.5}, "Fitted.")
    patch.undo()
    return tables


def test_every_column_of_numbers_names_its_unit(shown: list[Table]) -> None:
    assert len(shown) >= 15
    columns = [(table.title, str(column.header), list(column.cells)) for table in shown for column in table.columns]
    numeric = [(t, h) for t, h, cells in columns if any(NUMBER.fullmatch(str(cell)) for cell in cells)]
    assert len(numeric) >= 20
    missing = [(t, h) for t, h in numeric if h not in COUNTS and not re.search(r"\[.+\]$", h)]
    assert missing == []


@pytest.mark.parametrize(("length", "text"), [(-1e-9, "0.000"), (-2e-6, "-0.002"), (0.0, "0.000")])
def test_a_number_that_rounds_to_zero_has_no_minus(length: float, text: str) -> None:
    assert printing._millimetres(length) == text


def test_every_fixed_number_of_the_command_line_and_of_pages_is_written_without_a_minus_before_zero() -> None:
    # The option "z" of the format takes the minus away.
    files = [file for folder in ("cli", "pages") for file in (APPS / folder).rglob("*.py")]
    assert len(files) > 20
    found = [(file.name, text) for file in files for text in re.findall(r":\.\df\}", file.read_text(encoding="utf-8"))]
    assert found == []


def test_the_table_of_a_plan_names_the_confidence_as_its_document_does(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "160")
    document = {"hand": "h", "object": "o", "grasps": [], "rejected": {}, "closed": 0, "force_closed": 0}
    print_plan({**document, "seconds": {"total": 0.0}}, "Found none.")
    assert re.search(r"epsilon\W+confidence\W+links", capsys.readouterr().out)
