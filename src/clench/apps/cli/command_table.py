"""The commands by name; each imports its own modules when it runs, so that `--help` is quick."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from .commands.batch import batch
from .commands.calibrating import calibrate
from .commands.execute import execute
from .commands.export_import import export, import_
from .commands.generate import generate
from .commands.hand_command import hand
from .commands.objects import object_
from .commands.plan_command import plan
from .commands.record_command import record
from .commands.solve_command import solve
from .commands.view import view


def demo(
    *,
    out: Path = Path("clench_out"),
    hand: str = "robonaut2",
    object: str = "mug",
    seed: int | None = None,
    html: Path | None = None,
    json: bool = False,
) -> int:
    """Do the main job on a built-in hand and object: solve, figures, a page, simulated hold, record.

    Args:
        out: folder for the files.
        hand: built-in name, path to a .urdf or .xml file, or a name that clench[hands] finds (docs/own-hand.md).
        object: built-in name, path to a mesh, or a shape such as cylinder:r=0.03,h=0.1.
        seed: plan a grasp from this seed instead of the kept pose of the built-in hand on the mug.
        html: file (.html) for a page that shows the closing in any browser; grasp.html in the folder by default.
        json: print the solution as one JSON document, and nothing else, on standard output.
    """
    from .commands.demo import run_demo

    return run_demo((hand, object), out, seed, html or out / "grasp.html", json)


def bench(*arguments: str) -> int:
    """Run a benchmark of a checkout, e.g. `clench bench solve`; it checks its own answers.

    Args:
        arguments: name of the benchmark and its options.
    """
    from .inputs.checkout import load_benchmarks

    return int(load_benchmarks().main(list(arguments)))


COMMANDS: dict[str, Callable[..., int]] = {
    "demo": demo,
    "solve": solve,
    "plan": plan,
    "view": view,
    "batch": batch,
    "generate": generate,
    "hand": hand,
    "object": object_,
    "execute": execute,
    "export": export,
    "import": import_,
    "record": record,
    "calibrate": calibrate,
    "bench": bench,
}
