"""The command that solves many poses and writes the answers as arrays."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clench.apps.cli.inputs.command_files import read_command
from clench.apps.cli.inputs.scene_options import with_scene
from clench.core.exceptions import CommandError, FileError

if TYPE_CHECKING:
    import numpy as np


SCHEMA = "clench.batch/1"


def batch(
    *,
    hand: str,
    object: str,
    poses: Path | None = None,
    count: int = 100,
    seed: int = 0,
    command: Path | None = None,
    hand_file: Path | None = None,
    palm: str | None = None,
    scale: float = 1.0,
    table: tuple[float, ...] | None = None,
    obstacle: tuple[str, ...] = (),
    planes: int | None = None,
    planes_only: bool = False,
    threads: int | None = None,
    device: str = "cpu",
    chunk: int | None = None,
    out: Path | None = None,
    strict: bool = False,
    json: bool = False,
) -> int:
    """Solve one command at many poses of the hand, on all cores, and write the answers as arrays (docs/batch.md).

    Args:
        hand: built-in name, path to a .urdf or .xml file, or a name that clench[hands] finds (docs/own-hand.md).
        object: built-in name, path to a mesh, or a shape such as cylinder:r=0.03,h=0.1.
        poses: NumPy file (.npy) of rows [w, x, y, z, X, Y, Z] or of matrices 4 x 4; without it, clench draws approach
            poses.
        count: number of approach poses.
        seed: seed of the approach poses.
        command: command file (JSON) with everything but the poses; its hand_pose does not count.
        hand_file: TOML file that overrides the interpretation of the hand's model.
        palm: name of the palm link, to pick a hand inside a whole robot.
        scale: multiplies the object's lengths, e.g. 0.001 for a mesh in millimetres.
        table: put a table under the object: at its lowest point, or with its top at this height of the world [m].
        obstacle: obstacle in the world, as MESH_OR_SHAPE@x,y,z or MESH_OR_SHAPE@x,y,z,qw,qx,qy,qz [m]; may be given
            several times (docs/surroundings.md).
        planes: number of curl planes per finger.
        planes_only: close on the planes only; clench does not check the space between them, and certifies nothing.
        threads: number of threads; all cores by default.
        device: device that closes the fingers, cpu or cuda (an NVIDIA GPU; docs/batch.md).
        chunk: number of poses that are solved together; a GPU needs some ten thousand.
        out: NumPy file (.npz) for the answers. clench writes each solved chunk to a folder beside the file; the same
            call continues an interrupted run.
        strict: exit with 1 unless a pose gives a grasp.
        json: print one JSON document on standard output.
    """
    from dataclasses import replace

    import clench
    from clench.apps.cli.output.printing import print_batch, print_files
    from clench.apps.cli.output.results import print_json
    from clench.closing.collision.sizes import warn_of_size
    from clench.kernels.runtime.warming import warm_up
    from clench.solver.batch.batch_parts import check_batch_file
    from clench.solver.batch.devices import CPU, why_not
    from clench.solver.batch.solve_batch import CHUNK

    if out is not None:
        check_batch_file(out)
    reason = why_not(device)
    if reason is not None:
        sys.stderr.write(f"clench: {reason} Solving on the CPU.\n")
        device = CPU
    the_hand = clench.Hand.load(hand, hand_file=hand_file, palm=palm)
    the_object = clench.GraspObject.load(object, scale=scale)
    warn_of_size(the_hand, the_object)
    asked = clench.GraspCommand(clench.Pose.identity()) if command is None else read_command(command, the_hand)
    the_object = with_scene(the_object, asked.object_pose, table, obstacle)
    if planes_only:
        asked = replace(asked, full_width=False)
    if planes is not None:
        asked = replace(asked, planes=planes)
    if poses is None and count < 1:
        raise CommandError(f"--count: expected at least 1, got {count}.")
    # An error of the file comes before anything is compiled.
    read = None if poses is None else _read(poses)
    warm_up()
    rows = clench.approach_poses(the_hand, the_object, count, seed) if read is None else read
    began = time.perf_counter()
    size = CHUNK if chunk is None else chunk
    with _going_on(out):
        answers = clench.solve_batch(
            the_hand, the_object, rows, asked, threads=threads, chunk=size, device=device, out=out
        )
    seconds = time.perf_counter() - began
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "hand": the_hand.name,
        "object": the_object.name,
        "poses": len(answers),
        "status": answers.counts(),
        "certified": int(answers.certified.sum()),
        "seconds": seconds,
        "file": None if out is None else str(out),
    }
    if json:
        print_json(document)
    else:
        print_batch(document)
        print_files([] if out is None else [out])
    counts = answers.counts()
    return 0 if counts["grasp"] or (counts["partial"] and not strict) else 1


@contextmanager
def _going_on(out: Path | None) -> Iterator[None]:
    """Say where the parts are when a batch is interrupted."""
    from clench.solver.batch.batch_parts import parts_folder

    try:
        yield
    except KeyboardInterrupt:
        if out is not None and parts_folder(out).is_dir():
            sys.stderr.write(f"clench: what is solved is in '{parts_folder(out)}'; the same call goes on from there.\n")
        raise


def _read(path: Path) -> np.ndarray:
    """Read an array of poses; the solver checks its shape.

    Raises:
        FileError: missing, no array of numbers, or empty.
    """
    from clench.core.files.array_files import read_array
    from clench.core.pose_arrays import pose_rows

    rows = pose_rows(read_array(path), str(path))
    if not len(rows):
        raise FileError(path, "expected at least one pose, got none.")
    return rows
