"""Show objects in notebooks and browsers: cards with a small picture, and pages to turn around."""

from __future__ import annotations

import base64
import html
import io
import sys
import tempfile
import warnings
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from clench.apps.figures.drawing.camera import Image, fitted_camera
from clench.apps.figures.drawing.contact_labels import photograph
from clench.apps.figures.drawing.dots import covered, dotted
from clench.apps.figures.drawing.stage import Stage, solution_poses
from clench.apps.figures.drawing.viewpoints import focus_of, viewpoints
from clench.apps.figures.drawing.views import hand_sides
from clench.core.exceptions import ClenchError, CommandError
from clench.core.pose import FloatArray
from clench.execution.executing import check_geometry
from clench.models.appearance import Solid, SolidKind, hand_solids, object_solids
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.recent_scenes import recent_scene
from clench.planner.grasp_plan import GraspPlan, PlannedGrasp
from clench.solver.solution import GraspSolution

from .facts import status, text
from .page import hand_page_html, page_html

#: Size of the picture of a card, and of each of several [px].
_PICTURE: Final = (300, 230)
_SMALL: Final = (190, 150)
#: Grasps of a plan that have a picture.
_PICTURES: Final = 3
#: Small pictures show no more detail: deviation of round shapes [m], triangles of a shape.
_DEVIATION: Final = 4e-4
_TRIANGLES: Final = 8_000
#: Height of a page in a notebook [px].
_HEIGHT: Final = 600


def card(value: object) -> str | None:
    """Return the card of a hand, a solution, a planned grasp or a plan as HTML; None for anything else."""
    if isinstance(value, Hand):
        return _hand_card(value)
    if isinstance(value, GraspSolution):
        return _grasps_card([value], _solution_words(value))
    if isinstance(value, PlannedGrasp):
        words = f"<div>{text(value.kind.value)}, preshape {text(value.preshape)}, epsilon {value.epsilon:z.3f}</div>"
        return _grasps_card([value.solution], _solution_words(value.solution) + words)
    if isinstance(value, GraspPlan):
        return _plan_card(value)
    return None


def show(value: object, hand: Hand | None = None, obj: GraspObject | None = None) -> Path | None:
    """Show a page: in a notebook as the output of the cell, elsewhere in the browser.

    Args:
        value: a hand, a solution, a planned grasp or a plan. hand, obj: of a grasp, where they are not known.

    Returns:
        the file that the browser opens; None in a notebook.

    Raises:
        CommandError: hand and object are not known, or a plan has no grasp.
    """
    if isinstance(value, Hand):
        page = hand_page_html(value)
    elif isinstance(value, GraspSolution | PlannedGrasp | GraspPlan):
        solutions = _solutions(value)
        scene = (hand, obj) if hand is not None and obj is not None else _scene_of(solutions[0]) if solutions else None
        if solutions and scene is None:
            raise CommandError("show: hand and object of this grasp are not known here; expected show(hand, object).")
        page = page_html(*scene, value) if scene else page_html(hand, obj, value)  # type: ignore[arg-type]
    else:
        raise CommandError(f"show: expected a hand, a solution or a plan, got {type(value).__name__}.")
    if _in_notebook():
        _embed(page)
        return None
    folder = tempfile.mkdtemp(prefix="clench_")
    file = Path(folder) / "page.html"
    file.write_text(page, encoding="utf-8")
    if not webbrowser.open(file.as_uri()):
        sys.stderr.write(f"clench: no browser was found; open {file}\n")
    return file


def _in_notebook() -> bool:
    """Say whether this runs in a kernel of Jupyter or VS Code; a terminal of IPython shows no HTML."""
    module = sys.modules.get("IPython")
    shell: Any = None if module is None else module.get_ipython()
    return shell is not None and hasattr(shell, "kernel")


def _embed(page: str) -> None:
    from IPython.display import HTML, display

    style = f"width:100%;height:{_HEIGHT}px;border:1px solid rgba(128,128,128,0.4);border-radius:6px"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # advises frames by address, which have no content of their own
        display(HTML(f'<iframe srcdoc="{html.escape(page)}" style="{style}" title="clench"></iframe>'))


def _solutions(value: GraspSolution | PlannedGrasp | GraspPlan) -> list[GraspSolution]:
    if isinstance(value, GraspSolution):
        return [value]
    return [value.solution] if isinstance(value, PlannedGrasp) else [grasp.solution for grasp in value]


def _scene_of(solution: GraspSolution) -> tuple[Hand, GraspObject] | None:
    """Return hand and object of a solution: remembered, or loaded from the models that it names; None else."""
    found = recent_scene(solution.geometry_hash)
    if found is not None:
        return found
    try:
        hand = Hand.load(solution.hand_model, collision_source=solution.collision_source)
        source = solution.object_collision_source
        obj = GraspObject.load(solution.object_model, scale=solution.object_scale, collision_source=source)
        check_geometry(solution, hand, obj)
    except ClenchError:
        return None
    return hand, obj


def _solution_words(solution: GraspSolution) -> str:
    """Return the words of a card: names, status, reason, certificate, and which links touch."""
    touching = [c for c in solution.contacts if not c.passed]
    links = ", ".join(dict.fromkeys(text(c.link) for c in touching)) or "none"
    word = "certified" if solution.certified else "not certified"
    return "".join(
        [
            f"<div><b>{text(solution.hand)} on {text(solution.object)}</b></div>",
            f"<div>{_status(solution)} {text(solution.reason.get('text', ''))}</div>",
            f"<div>{len(touching)} contacts: {links}</div>",
            f"<div>{word}; <code>.show()</code> turns it around</div>",
        ]
    )


def _status(solution: GraspSolution) -> str:
    """Return the status with a colour of its own: a notebook has none of the page's styles."""
    colors = {"grasp": "#0b7a53", "partial": "#a06a00"}
    color = colors.get(solution.status.value, "#c0392b")
    return status(solution).replace("<span ", f'<span style="color:{color};font-weight:bold" ', 1)


def _grasps_card(solutions: Sequence[GraspSolution], words: str, size: tuple[int, int] = _PICTURE) -> str:
    scene = _scene_of(solutions[0])
    if scene is None:
        return _framed("", f"{words}<div>no picture: hand and object are not known here</div>")
    hand, obj = scene
    solids = [
        *hand_solids(hand, solutions[0].collision_source, _DEVIATION, _TRIANGLES),
        *object_solids(obj, solutions[0].object_collision_source, _DEVIATION, _TRIANGLES),
    ]
    poses = [solution_poses(hand, solids, solution) for solution in solutions]
    points = [np.array([c.position for c in s.contacts if not c.passed]).reshape(-1, 3) for s in solutions]
    return _framed("".join(_pictures(solids, poses, points, size)), words)


def _plan_card(plan: GraspPlan) -> str:
    listed = [f"{k}: {text(g.kind.value)} {g.epsilon:z.3f}" for k, g in enumerate(plan, start=1)]
    more = "" if len(listed) <= 8 else f" and {len(listed) - 8} more"
    words = f"<div><b>{text(plan.hand)} on {text(plan.object)}</b></div><div>{text(plan.text)}</div>"
    if not len(plan):
        return _framed("", words)
    words += f"<div>kind and epsilon: {', '.join(listed[:8])}{more}; <code>.show()</code> shows all</div>"
    return _grasps_card([grasp.solution for grasp in plan][:_PICTURES], words, _SMALL)


def _hand_card(hand: Hand) -> str:
    solids = hand_solids(hand, hand.default_source, _DEVIATION, _TRIANGLES)
    links = hand.link_poses(hand.open_angles())
    poses = np.array([links[solid.index] for solid in solids]).reshape(-1, 4, 4)
    fingers = ", ".join(f"{text(f.name)} ({len(f.joints)})" for f in hand.fingers)
    words = (
        f"<div><b>{text(hand.name)}</b></div><div>fingers, with their joints: {fingers}</div>"
        f"<div>palm: {text(hand.links[hand.palm].name)}; <code>.show()</code> closes it</div>"
    )
    warned = f"<div>{len(hand.warnings)} warnings</div>" if hand.warnings else ""
    return _framed("".join(_pictures(solids, [poses], [np.empty((0, 3))], _PICTURE, hand_sides(hand))), words + warned)


def _pictures(
    solids: Sequence[Solid],
    poses: Sequence[FloatArray],
    points: Sequence[FloatArray],
    size: tuple[int, int],
    sides: tuple[list[FloatArray], FloatArray] | None = None,
) -> list[str]:
    """Return images of scenes as HTML: hand and object on a transparent ground, contacts as dots.

    Args:
        solids: of all scenes. poses, points: of the solids and of the contacts of every scene. size: in pixels.
        sides: viewpoints, the best first, and upward directions; None: those that show the contacts best.
    """
    found = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a plain picture says nothing: the card is there
        with Stage(solids, poses[0]) as stage:
            for posed, touched in zip(poses, points, strict=True):
                stage.pose(posed)
                focus = focus_of(stage)
                (towards, *_), above = sides or (viewpoints(stage, focus, touched, 1), None)
                camera = fitted_camera(towards, focus, size, above=above, filled=0.94)
                image, picture, hidden = photograph(stage, camera, touched)
                kinds = [solid.kind is not SolidKind.OBSTACLE for solid in stage.solids]
                seen = np.array([*kinds, False])[picture.solid]
                alpha = seen.astype(np.float32).reshape(size[1], 2, size[0], 2).mean(axis=(1, 3))
                places = camera.project(touched)[:, :2]
                found.append(_image(dotted(image, places, hidden), np.maximum(alpha, covered(alpha.shape, places))))
    return found


def _image(image: Image, alpha: Image) -> str:
    from PIL import Image as Pillow

    pixels = np.dstack([np.clip(image, 0.0, 1.0), alpha])
    content = io.BytesIO()
    Pillow.fromarray(np.round(255.0 * pixels).astype(np.uint8)).save(content, "PNG")
    height, width = alpha.shape
    data = base64.b64encode(content.getvalue()).decode()
    return f'<img src="data:image/png;base64,{data}" width="{width}" height="{height}" alt="">'


def _framed(pictures: str, words: str) -> str:
    """Return pictures beside words; colours are those of the notebook."""
    box = "display:inline-flex;flex-wrap:wrap;gap:14px;align-items:center;padding:8px 14px;max-width:100%;"
    line = "border:1px solid rgba(128,128,128,0.4);border-radius:8px;line-height:1.5"
    return f'<div style="{box}{line}"><div>{pictures}</div><div style="max-width:44em">{words}</div></div>'
