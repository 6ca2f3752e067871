"""The command that shows an object: its size, its mass properties, and how it rests on a table."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from clench.models.objects.object_report import ObjectReport

#: Rows of the table of stable poses.
_MOST_ROWS = 10


def object_(
    model: str,
    /,
    *,
    scale: float = 1.0,
    center_of_mass: tuple[float, float, float] | None = None,
    json: bool = False,
) -> int:
    """Show an object: size, volume, centre of mass, watertight or not, and stable poses on a table.

    Args:
        model: built-in name, path to a mesh, or a shape such as cylinder:r=0.03,h=0.1.
        scale: multiplies the object's lengths, e.g. 0.001 for a mesh in millimetres.
        center_of_mass: in the object's frame [m]; by default that of uniform density.
        json: print one JSON document on standard output.
    """
    import clench
    from clench.apps.cli.output.results import print_json
    from clench.models.objects.object_report import describe_object

    report = describe_object(clench.GraspObject.load(model, scale=scale), center_of_mass)
    if json:
        print_json(report.to_dict())
    else:
        print_object(report)
    return 0


def print_object(report: ObjectReport) -> None:
    """Print the report on an object."""
    from clench.apps.cli.output.tables import console_out, plain, print_table, table_with

    out = console_out()
    summary = table_with("object", "", "")
    for label, text in report.summary_rows():
        summary.add_row(plain(label), plain(text))
    print_table(out, summary)
    rows = report.pose_rows()
    if rows:
        title = f"stable poses on a table, {min(len(rows), _MOST_ROWS)} of {len(rows)}, the most probable first"
        poses = table_with(title, "share", "points down", "centre [mm]", "stands on")
        for row in rows[:_MOST_ROWS]:
            poses.add_row(*map(plain, row))
        print_table(out, poses)
    said = [] if report.no_stable_pose is None else [("no stable pose", report.no_stable_pose)]
    for label, text in [*said, *(("warning", warning) for warning in report.warnings)]:
        out.print(f"[yellow]{label}:[/yellow] {plain(text)}")
