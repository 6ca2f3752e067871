"""`clench export` and `clench import`: grasps in other programs' files."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from clench.base.errors import FileError, UnknownNameError

# The values of `GraspFormat`, written out so that the command line loads without NumPy.
Format = Literal["isaac_grasp", "dexgraspbench", "moveit_grasp"]


def export(solutions: tuple[Path, ...], /, *, out: Path, format: Format | None = None, json: bool = False) -> int:
    """Write solutions as isaac_grasp YAML, DexGraspBench npy or moveit_msgs/Grasp JSON.

    Args:
        solutions: files written by `clench solve --out` or `GraspSolution.save`.
        out: the file.
        format: of the file; by its ending (.yaml, .npy, .json) by default.
        json: print one JSON document on standard output.
    """
    import clench
    from clench.base.json_files import check_writable

    from .printing import print_files
    from .results import print_json

    check_writable(out)
    read = [clench.GraspSolution.load(path) for path in solutions]
    clench.export_grasps(out, read, format)
    if json:
        print_json({"schema": "clench.export/1", "file": str(out), "grasps": len(read)})
    else:
        print_files([out])
    return 0


def import_(
    grasps: Path,
    /,
    *,
    hand: str,
    out: Path,
    grasp: str | None = None,
    format: Format | None = None,
    hand_file: Path | None = None,
    palm: str | None = None,
    json: bool = False,
) -> int:
    """Read another program's grasps and write a command file for each: posture joints kept, the others to be solved.

    Args:
        grasps: isaac_grasp YAML, DexGraspBench npy or moveit_msgs/Grasp JSON.
        hand: built-in name, or path to a .urdf or .xml file.
        out: folder for the command files.
        grasp: only the grasp of this name.
        format: of the file; by its ending (.yaml, .npy, .json) by default.
        hand_file: TOML file that overrides what was found in the hand's model.
        palm: name of the palm link, to pick a hand inside a whole robot.
        json: print one JSON document on standard output.
    """
    import clench
    from clench.base.json_files import check_folder, write_json
    from clench.models.command_file import command_to_dict

    from .printing import print_files
    from .results import make_folder, print_json

    check_folder(out)
    the_hand = clench.Hand.load(hand, hand_file=hand_file, palm=palm)
    found = clench.import_grasps(grasps, format)
    if grasp is not None and grasp not in [g.name for g in found]:
        raise UnknownNameError("grasp", grasp, f"'{grasps}'", [g.name for g in found])
    wanted = [g for g in found if grasp in (None, g.name)]
    for g in wanted:
        if not g.name or Path(g.name).name != g.name:
            raise FileError(grasps, f"grasp '{g.name}': the name cannot be that of a file.")
    commands = {out / f"{g.name}.json": command_to_dict(g.command(the_hand)) for g in wanted}
    make_folder(out)
    for file, document in commands.items():
        write_json(file, document, "command")
    if json:
        written = [
            {"name": g.name, "file": str(file), "confidence": g.confidence}
            for g, file in zip(wanted, commands, strict=True)
        ]
        print_json({"schema": "clench.import/1", "commands": written})
    else:
        print_files(list(commands))
    return 0
