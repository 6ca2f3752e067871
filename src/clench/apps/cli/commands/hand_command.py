"""`clench hand`: show how a hand is understood, and check it."""

from __future__ import annotations

from pathlib import Path

from clench.apps.cli.inputs.choices import Source


def hand(
    model: str,
    /,
    *,
    hand_file: Path | None = None,
    palm: str | None = None,
    collision_source: Source | None = None,
    figure: Path | None = None,
    json: bool = False,
) -> int:
    """Show the interpretation of a hand, check it, and give advice: fingers, roles, coupling, preshapes, findings.

    Args:
        model: built-in name, path to a .urdf or .xml file, or a name that clench[hands] finds (docs/own-hand.md).
        hand_file: TOML file that overrides the interpretation of the model.
        palm: name of the palm link, to pick a hand inside a whole robot.
        collision_source: geometry to use.
        figure: file (.png, .pdf, .svg, …) for a picture of the hand: joint axes, roles, closing directions, curl
            planes, and its preshapes.
        json: print one JSON document on standard output.
    """
    import clench
    from clench.apps.cli.output.preshape_tables import print_preshapes
    from clench.apps.cli.output.printing import print_files, print_hand
    from clench.apps.cli.output.results import print_json
    from clench.models.hand.hand_report import describe_hand
    from clench.solver.preshapes.preshapes import opposition_zones

    if figure is not None:
        from clench.apps.figures.drawing.style import check_figure

        check_figure(figure)
    loaded = clench.Hand.load(model, hand_file=hand_file, palm=palm, collision_source=collision_source)
    report = describe_hand(loaded, clench.check_hand(loaded))
    preshapes = opposition_zones(loaded)
    if figure is not None:
        from clench.apps.figures.maps.hand_map import draw_hand_map

        draw_hand_map(loaded, figure, preshapes=preshapes)
    if json:
        print_json(report.to_dict() | {"preshapes": [shape.to_dict() for shape in preshapes]})
    else:
        print_hand(report)
        print_preshapes(preshapes)
        print_files([] if figure is None else [figure])
    return 0
