"""`clench export` and `clench import`: grasps in other programs' files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from clench.apps.cli.parsing import as_range
from clench.core.exceptions import CommandError, FileError, UnknownNameError

if TYPE_CHECKING:
    from clench.apps.cli.inputs.export_sources import ReadGrasps

# The values of `GraspFormat`, written out so that the command line loads without NumPy.
Format = Literal["isaac_grasp", "dexgraspbench", "moveit_grasp"]
# The same formats, and those of `DatasetFormat`.
AnyFormat = Literal["isaac_grasp", "dexgraspbench", "moveit_grasp", "hdf5"]


def export(
    solutions: tuple[Path, ...],
    /,
    *,
    out: Path,
    format: AnyFormat | None = None,
    hand: str | None = None,
    object: str | None = None,
    hand_file: Path | None = None,
    palm: str | None = None,
    scale: float | None = None,
    table: tuple[float, ...] | None = None,
    obstacle: tuple[str, ...] = (),
    root: str | None = None,
    name: str | None = None,
    hold: bool = False,
    mass: tuple[float, ...] = (),
    friction: tuple[float, ...] = (),
    stiffness: float | None = None,
    json: bool = False,
) -> int:
    """Write grasps as isaac_grasp YAML, DexGraspBench npy, moveit_msgs/Grasp JSON, or scenes (docs/exporting.md).

    Args:
        solutions: files written by `clench solve --out` or `GraspSolution.save`, JSON lists of solutions, plan.json of
            `clench plan --out`, or batches (.npz) written by `clench batch --out` (all poses with a grasp); or one
            dataset: the folder of `clench generate`, or its grasps.parquet.
        out: the file; for several grasps in the format dexgraspbench, a folder; of a dataset, a folder or an HDF5 file.
            A .glb, .usd, .usda or .usdc file shows hand, object and contacts; USD has the grasp lines, too.
        format: of the file; by its ending (.yaml, .npy, .json, .h5) by default, a folder is dexgraspbench. hdf5 is for
            datasets.
        hand: model of the hand; by default the solutions' own.
        object: model of the object; by default the solutions' own.
        hand_file: TOML file that was used to load the hand.
        palm: palm link that was used to load the hand.
        scale: of the object; by default the solutions' own.
        table: table of the solutions, as for `clench solve`.
        obstacle: obstacles of the solutions, as for `clench solve`; may be given several times.
        root: link whose pose is written, or world (of the hand's model file): dexgraspbench's default; else the palm.
        name: of the object in the file; its own by default.
        hold: test every grasp in simulation; a grasp that holds has confidence 1.
        mass: of the object, for squeeze and test, kg; two numbers are a range.
        friction: of its contacts, for squeeze and test; two numbers are a range.
        stiffness: gain of the servos that will hold the postures, Nm/rad; that of the hand's model by default.
        json: print one JSON document on standard output.
    """
    import clench
    from clench.apps.cli.inputs.export_sources import make_test, read_grasps, refuse_several
    from clench.apps.cli.output.printing import print_exported
    from clench.apps.cli.output.results import print_json
    from clench.core.files.json_files import check_folder, check_writable
    from clench.execution.formats.exchange import DATASETS, format_of
    from clench.execution.formats.scene_files import is_scene_file

    if len(solutions) == 1 and (solutions[0].is_dir() or solutions[0].suffix == ".parquet"):
        unused = (hand, object, hand_file, palm, scale, root, name, stiffness, hold, mass, friction, obstacle)
        return _export_dataset(solutions[0], out, format, any(unused) or table is not None, json)
    if format == "hdf5" or out.suffix in DATASETS:
        raise CommandError("hdf5: is for datasets; expected the folder of one, or its grasps.parquet.")
    if format is None and is_scene_file(out):
        if any((root, name, stiffness, hold, mass, friction)):
            raise CommandError("export: a scene shows grasps as they are; leave out --root, --name, --hold and forces.")
        check_writable(out)
        read = read_grasps(solutions, hand, object, (hand_file, palm), scale, (table, obstacle))
        return _export_scene(read, out, json)
    chosen = format_of(out, format, read=False)
    one_each = chosen == "dexgraspbench" and (out.is_dir() or not out.suffix)
    (check_folder if one_each else check_writable)(out)
    planned = {"mass": as_range(mass, "--mass"), "friction": as_range(friction, "--friction")}
    tested = make_test(**planned) if hold else None
    read = read_grasps(solutions, hand, object, (hand_file, palm), scale, (table, obstacle))
    if chosen == "isaac_grasp":
        refuse_several(read, chosen)
    report = clench.export_grasps(
        out,
        read.solutions,
        chosen,
        hand=read.hand,
        obj=read.objects,
        root=root,
        name=name,
        hold=tested,
        **planned,
        stiffness=stiffness,
    )
    notes = [*read.notes, *report.notes]
    if json:
        print_json(
            {
                "schema": "clench.export/1",
                "file": str(out),
                "files": [str(file) for file in report.files],
                "grasps": len(report.confidences),
                "confidences": list(report.confidences),
                "notes": notes,
            }
        )
    else:
        print_exported(report, notes)
    return 0


def _export_scene(read: ReadGrasps, out: Path, json: bool) -> int:
    """Write hand, object and contacts as a file for other programs to show."""
    import clench
    from clench.apps.cli.inputs.export_sources import refuse_several
    from clench.apps.cli.output.printing import print_files
    from clench.apps.cli.output.results import print_json

    refuse_several(read, "scene")
    if read.hand is None:
        raise CommandError(f"hand: '{read.solutions[0].hand_model}' cannot be loaded; give --hand.")
    clench.formats.export_scene(out, read.solutions, read.hand, read.objects[0])
    if json:
        document = {"schema": "clench.export/1", "file": str(out), "files": [str(out)]}
        print_json(document | {"grasps": len(read.solutions), "notes": list(read.notes)})
    else:
        print_files([out])
        for note in read.notes:
            sys.stdout.write(f"{note}\n")
    return 0


def _export_dataset(source: Path, out: Path, format: AnyFormat | None, more: bool, json: bool) -> int:
    """Write a dataset in another format, with all grasps as computed."""
    import clench.dataset
    from clench.apps.cli.output.printing import print_files
    from clench.apps.cli.output.results import print_json
    from clench.execution.formats.exchange import DATASETS

    if more:
        raise CommandError(
            "export: a dataset is written as it was computed; leave out all options but --out, --format."
        )
    endings = {**dict.fromkeys(DATASETS, "hdf5"), ".yaml": "isaac_grasp", ".yml": "isaac_grasp", "": "dexgraspbench"}
    if format is None and out.suffix not in endings:
        known = ", ".join(ending for ending in endings if ending)
        raise CommandError(f"--out {out}: expected a folder, or a file that ends with {known}; or name the --format.")
    chosen = format or endings[out.suffix]
    dataset = clench.dataset.open(source)
    files = clench.dataset.export(dataset, out, chosen)
    if json:
        listed = [str(file) for file in files]
        print_json(
            {"schema": "clench.export/1", "file": str(out), "files": listed, "grasps": len(dataset), "notes": []}
        )
    else:
        print_files([*files[:10]])
    return 0


def import_(
    grasps: Path,
    /,
    *,
    hand: str,
    out: Path,
    grasp: str | None = None,
    format: Format | None = None,
    root: str | None = None,
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
        root: link whose pose the file has, or world (of the hand's model file); by default the file's own, else world
            for dexgraspbench and the palm for the others.
        hand_file: TOML file that overrides the interpretation of the hand's model.
        palm: name of the palm link, to pick a hand inside a whole robot.
        json: print one JSON document on standard output.
    """
    from dataclasses import replace

    import clench
    from clench.apps.cli.output.printing import print_files
    from clench.apps.cli.output.results import print_json
    from clench.core.files.file_bytes import make_folder
    from clench.core.files.json_files import check_folder, write_json
    from clench.models.command_file import command_to_dict

    check_folder(out)
    the_hand = clench.Hand.load(hand, hand_file=hand_file, palm=palm)
    found = [replace(g, root=root or g.root) for g in clench.import_grasps(grasps, format)]
    if root is not None and root != "world":
        the_hand.link_index(root)  # refuses a name that is no link's
    if grasp is not None and grasp not in [g.name for g in found]:
        raise UnknownNameError("grasp", grasp, f"'{grasps}'", [g.name for g in found])
    requested = [g for g in found if grasp in (None, g.name)]
    for g in requested:
        if not g.name or Path(g.name).name != g.name:
            raise FileError(grasps, f"grasp '{g.name}': the name cannot be that of a file.")
    commands = {out / f"{g.name}.json": command_to_dict(g.command(the_hand)) for g in requested}
    make_folder(out)
    for file, document in commands.items():
        write_json(file, document, "command")
    if json:
        written = [
            {"name": g.name, "file": str(file), "confidence": g.confidence}
            for g, file in zip(requested, commands, strict=True)
        ]
        print_json({"schema": "clench.import/1", "commands": written})
    else:
        print_files(list(commands))
    return 0
