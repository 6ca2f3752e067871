"""Tables for people: every column of numbers names its unit."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import clench
from clench.apps.cli.output import choice_tables, printing, tables
from clench.apps.cli.output.plan_table import print_plan
from clench.models.hand.hand_report import describe_hand

if TYPE_CHECKING:
    from rich.table import Table

APPS = Path(clench.__file__).parent / "apps"
#: Heads of columns whose numbers count or name something.
COUNTS = {
    *("", "id", "seed", "touching", "finger posture", "step", "poses", "share"),
    *("thumb", "index", "middle", "ring", "little"),
}
NUMBER = re.compile(r"[±+-]?\d[\d.e+-]*")


@pytest.fixture(scope="module")
def shown() -> list[Table]:
    """All tables that solving, batching, executing and recording print."""
    found: list[Table] = []
    patch = pytest.MonkeyPatch()

    def noted(title: str, *columns: str) -> Table:
        found.append(tables.table_with(title, *columns))
        return found[-1]

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
    printing.print_weights({"epsilon": 0.5}, "Fitted.")
    patch.undo()
    return found


def test_every_column_of_numbers_names_its_unit(shown: list[Table]) -> None:
    assert len(shown) >= 15
    columns = [(table.title, str(column.header), list(column.cells)) for table in shown for column in table.columns]
    numeric = [(t, h) for t, h, cells in columns if any(NUMBER.fullmatch(str(cell)) for cell in cells)]
    assert len(numeric) >= 20
    missing = [(t, h) for t, h in numeric if h not in COUNTS and not re.search(r"\[.+\]$", h)]
    assert missing == []


def lines_of(table: Table, width: int) -> list[str]:
    from rich.console import Console

    console = Console(width=width, record=True, file=io.StringIO(), color_system=None)
    tables.print_table(console, table)
    return console.export_text().splitlines()


def words_of(table: Table) -> set[str]:
    from rich.text import Text

    texts = [cell for column in table.columns for cell in (column.header, *column.cells)]
    return {word for text in texts for word in Text.from_markup(str(text)).plain.split()}


def test_every_table_keeps_its_words_whole_in_80_columns(shown: list[Table]) -> None:
    for table in shown:
        lines = lines_of(table, 80)
        assert max(map(len, lines)) <= 80
        printed = set(re.split(r"[\s┃│]+", "\n".join(lines)))
        assert words_of(table) - printed == set(), table.title


def test_a_table_that_is_too_wide_loses_its_frame_and_then_breaks_words() -> None:
    def made() -> Table:
        table = tables.table_with("", "name", "other")
        table.add_row("a_name_that_is_long", "another_name_of_a_joint")
        return table

    assert lines_of(made(), 50)[0].startswith("┏")
    assert lines_of(made(), 45)[2].split() == ["a_name_that_is_long", "another_name_of_a_joint"]
    assert max(map(len, lines_of(made(), 30))) <= 30


def test_short_cells_are_whole_before_long_ones_and_heads() -> None:
    table = tables.table_with("", "some long head", "angles [deg]", "reason")
    table.add_row("a", "-36.2 -15.9 55.0 8.9", "a reason in many words that has to be broken")
    lines = lines_of(table, 60)
    assert any("-36.2 -15.9 55.0 8.9" in line for line in lines)
    assert not any("some long head" in line for line in lines)


@pytest.mark.parametrize(("length", "text"), [(-1e-9, "0.000"), (-2e-6, "-0.002"), (0.0, "0.000")])
def test_a_number_that_rounds_to_zero_has_no_minus(length: float, text: str) -> None:
    assert printing._millimetres(length) == text


def test_every_fixed_number_of_the_command_line_and_of_pages_is_written_without_a_minus_before_zero() -> None:
    # The option "z" of the format takes the minus away.
    files = [file for folder in ("cli", "pages") for file in (APPS / folder).rglob("*.py")]
    assert len(files) > 20
    found = [(file.name, text) for file in files for text in re.findall(r":\.\df\}", file.read_text(encoding="utf-8"))]
    assert found == []


def planned(**more: object) -> dict[str, object]:
    pose = {"position": [-0.0351, -0.0852, 0.1063]}
    solution = {"hand_pose": pose, "contacts": [], "squeeze": {"torques": {"a": -0.345}}}
    grasp = {"solution": solution, "kind": "precision", "preshape": "curled-145mm", "epsilon": 0.13, "confidence": 0.99}
    rest = {"rejected": {}, "closed": 0, "force_closed": 0, "seconds": {"total": 0.0}}
    return {"hand": "h", "object": "o", "grasps": [grasp | more], **rest}


def test_the_table_of_a_plan_names_the_confidence_as_its_document_does(capsys: pytest.CaptureFixture[str]) -> None:
    print_plan(planned() | {"grasps": []}, "Found none.")
    assert re.search(r"epsilon\W+confidence\W+links", capsys.readouterr().out)


@pytest.mark.parametrize("more", [{}, {"hold": {"held": True}}])
def test_the_table_of_a_plan_fits_80_columns_and_explains_its_columns(
    more: dict[str, object], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    print_plan(planned(**more), "Found one.")
    printed = capsys.readouterr().out
    assert {"precision", "curled-145mm", "confidence", "-85", "0.345"} <= set(re.split(r"[\s┃│]+", printed))
    assert max(map(len, printed.splitlines())) <= 80
    for name in ("palm", "epsilon", "confidence", "links", "torque"):
        assert f"{name}: " in " ".join(printed.split())
    assert ("held: result of the hold test." in " ".join(printed.split())) == bool(more)
