"""Trials of extreme values, through the Python interface and as arguments of the command line."""

import contextlib
import io
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import clench
from clench.core.pose import Pose
from clench.models.shapes import Shape, ShapeKind

from .file_trials import (
    array_of_poses,
    grasps_in_yaml,
    included_model,
    joint_map_file,
    pickled_grasps,
    picture,
    record_schema,
    trajectory_file,
)
from .mutation import TEXTS, VALUES, Rng, pick, spoil_text
from .originals import COMMAND, SHAPES, URDF
from .outcomes import Trial, WrongAnswerError
from .trials import (
    Maker,
    a_pose,
    calibration_file,
    command_file,
    document_of,
    good,
    hand_file,
    hand_model,
    model_in,
    number_text,
    numbers,
    object_mesh,
    odd_path,
    path_argument,
    record_file,
    shape_text,
    solution_file,
    solved,
)

#: Scales and sizes from which on only boxes are solved with: round things much larger than a hand have a quarter of a
#: million facets, which is right, but slow [-], [m].
ROUND_SCALE, ROUND_SIZE = 3.0, 0.1
#: Share of command lines that are run in a process of their own.
PROCESSES = 0.01


def pose_value(rng: Rng, folder: Path) -> Trial:
    position, wxyz = pick(rng, [pick(rng, VALUES), numbers(rng, 3)]), pick(rng, [pick(rng, VALUES), numbers(rng, 4)])

    def run() -> Any:
        pose = Pose(position, wxyz=wxyz)
        return [pose.wxyz_xyz, pose.matrix, Pose.from_dict(pose.to_dict()).wxyz_xyz]

    return Trial("pose", run, ("pose",))


def command_value(rng: Rng, folder: Path) -> Trial:
    hand, obj, _, _ = good()
    key = pick(rng, [k for k in COMMAND if not k.endswith("_pose")])
    value = pick(
        rng, [*VALUES, 1, 2, "proximal-first", {"index_a": float("nan")}, {"index_b": 0.1}, {1: 2.0}, ("index",)]
    )
    # Counts that are allowed but take long are no mistakes.
    if isinstance(value, int | float) and key in ("planes", "rounds") and value > 20:
        value = 20

    def run() -> Any:
        command = replace(
            clench.GraspCommand(hand_pose=Pose([0.0, 0.0, -0.05]), planes=1, preshape="open"), **{key: value}
        )
        return document_of(clench.solve(hand, obj, command))

    return Trial(
        "command value", run, (key, "index", "thumb", "palm", "criteri", "calibration", "Finger", "Link", "Preset")
    )


def far_and_near(rng: Rng, folder: Path) -> Trial:
    """Objects of any size, anywhere."""
    hand = good()[0]

    def run() -> Any:
        scale = float(10.0 ** pick(rng, [rng.uniform(-12, 12), rng.uniform(-2, 2)]))
        shape = pick(rng, SHAPES) if scale < ROUND_SCALE else "box:x=0.03,y=0.03,z=0.05"
        obj = clench.GraspObject.load(shape, scale=scale, pose=a_pose(rng))
        answer = document_of(
            clench.solve(hand, obj, clench.GraspCommand(hand_pose=a_pose(rng), planes=1, preshape="open"))
        )
        if rng.random() < 0.1:
            answer["poses"] = [p.wxyz_xyz for p in clench.approach_poses(hand, obj, 1, int(rng.integers(1000)))]
        return answer

    return Trial("far and near", run)


def mesh_value(rng: Rng, folder: Path) -> Trial:
    """Arrays that are no mesh, or hardly one."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=int(rng.integers(0, 2)), radius=0.02)
    vertices, triangles = np.array(ball.vertices), np.array(ball.faces)
    kind = int(rng.integers(9))
    if kind == 0:
        vertices[int(rng.integers(len(vertices)))] = numbers(rng, 3)
    elif kind == 1:
        triangles[int(rng.integers(len(triangles)))] = pick(rng, [0, -1, len(vertices), 10**9])
    elif kind == 2:
        vertices *= pick(rng, [0.0, 1e-300, 1e-30, 1e-9, 1e9, 1e30, 1e200, 1e308, -1.0])
    elif kind == 3:
        vertices[:, int(rng.integers(3))] = pick(rng, [0.0, 1e-12, 1e12])
    elif kind == 4:
        triangles = triangles[: int(rng.integers(0, 4))]
    elif kind == 5:
        vertices += pick(rng, [1e3, 1e9, 1e15, 1e300])
    elif kind == 6:
        vertices[:] = np.round(vertices, int(rng.integers(1, 4)))
    elif kind == 7:
        triangles = triangles[:, ::-1] if rng.random() < 0.5 else np.vstack([triangles] * 3)
    given = pick(rng, [(vertices, triangles)] * 8 + [(pick(rng, VALUES), triangles), (vertices, pick(rng, VALUES))])
    solves = rng.random() < SOLVES

    def run() -> Any:
        obj = clench.GraspObject.from_meshes([given], name="thing", pose=Pose.identity())
        return [obj, solved(good()[0], obj, rng) if solves else None]

    return Trial("mesh value", run, ("thing",))


SOLVES = 0.5


def shape_value(rng: Rng, folder: Path) -> Trial:
    kind = pick(rng, [k for k in ShapeKind if k is not ShapeKind.MESH])
    size = tuple(float(v) for v in np.abs(numbers(rng, 3)))

    def run() -> Any:
        obj = clench.GraspObject.from_shape(Shape(kind, size), name="thing")
        return [obj, solved(good()[0], obj, rng) if kind is ShapeKind.BOX or max(size) < ROUND_SIZE else None]

    return Trial("shape value", run, ("thing",))


def posture_value(rng: Rng, folder: Path) -> Trial:
    hand, obj, solution, _ = good()
    q = pick(rng, [numbers(rng, 3), numbers(rng, 2), {"index_a": pick(rng, VALUES)}, {"none": 0.0}, pick(rng, VALUES)])
    call: Callable[[], Any] = pick(
        rng,
        [
            lambda: clench.GraspCommand.from_posture(hand, q, Pose.identity()).preshape,
            lambda: clench.approach_poses(hand, obj, int(rng.integers(-1, 2)), int(rng.integers(-5, 5)), preshape=q),
            lambda: clench.sensitivity(replace(solution, object_pose=a_pose(rng)), hand, obj).to_dict(),
            lambda: clench.pose_error(
                hand, obj, clench.GraspCommand(a_pose(rng), planes=1, preshape="open"), *numbers(rng, 2)
            ).to_dict(),
            lambda: clench.plan_trajectory(solution, hand, speed=numbers(rng, 1)[0]).to_dict(),
        ],
    )
    return Trial("posture value", call)


def command_line(rng: Rng, folder: Path) -> Trial:
    """Arguments of the command line: known options with odd values, and odd options."""
    model = str(model_in(folder, URDF))
    arguments = _arguments(rng, folder, model)
    apart = rng.random() < PROCESSES

    def run() -> Any:
        code, out, err = _in_process(arguments) if apart else _in_this_process(arguments)
        if code not in (0, 1, 2) or "Traceback" in err or (code == 2 and len(err) < 20):
            raise WrongAnswerError(f"exit code {code} of {arguments}: {err[-400:]}")
        if "--json" in arguments and code != 2 and out and not {"-h", "--help", "--version"} & set(arguments):
            json.loads(out, parse_constant=_no_constant)
        return code

    return Trial("command line", run)


def _arguments(rng: Rng, folder: Path, model: str) -> list[str]:
    solution, command = folder / "solution.json", folder / "command.json"
    good()[2].save(solution)
    command.write_bytes(spoil_text(rng, json.dumps(COMMAND)) if rng.random() < 0.3 else json.dumps(COMMAND).encode())
    name = pick(rng, ["solve"] * 5 + ["hand"] * 3 + ["record"] * 2 + ["execute", "nonsense", "--version", ""])

    def odd() -> str:
        kind = int(rng.integers(3))
        if kind < 2:
            return str(pick(rng, TEXTS)) if kind else number_text(rng)
        (inside := folder / f"odd{len(list(folder.iterdir()))}").mkdir()
        return odd_path(rng, inside)

    base = {
        "solve": ["--hand", model, "--object", "sphere:r=0.02", "--planes", "1"],
        "hand": [model],
        "record": [str(folder / "record.sqlite")],
        "execute": [str(solution), "--speed", "0"],
    }.get(name, [])
    options = {
        "solve": [
            "--command",
            "--hand-file",
            "--palm",
            "--scale",
            "--collision-source",
            "--planes",
            "--order",
            "--seed",
        ],
        "hand": ["--hand-file", "--palm", "--collision-source"],
        "record": ["--id", "--hand", "--object", "--status", "--limit"],
        "execute": ["--hand", "--object", "--palm", "--speed", "--actuator"],
    }.get(name, ["--help"])
    arguments = [name, *base, *(["--json"] if rng.random() < 0.5 else [])]
    for _ in range(int(rng.integers(0, 3))):
        option = pick(rng, options)
        value = str(command) if option == "--command" and rng.random() < 0.8 else odd()
        arguments += [option, value]
    if rng.random() < 0.2 and len(arguments) > 1:
        del arguments[int(rng.integers(1, len(arguments)))]
    if name == "solve" and "--planes" in arguments:
        arguments = ["3" if a.isdigit() and len(a) > 3 else a for a in arguments]
    return [a.replace("\0", "") for a in arguments]


def _in_this_process(arguments: list[str]) -> tuple[int, str, str]:
    from clench.apps.cli.main import main

    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(arguments)
    return code, out.getvalue(), err.getvalue()


def _in_process(arguments: list[str]) -> tuple[int, str, str]:
    program = "from clench.apps.cli.main import main; raise SystemExit(main())"
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        capture_output=True,
        timeout=60,
        check=False,
        stdin=subprocess.DEVNULL,
    )
    return done.returncode, done.stdout.decode(), done.stderr.decode(errors="replace")


def _no_constant(name: str) -> None:
    raise WrongAnswerError(f"{name} in the document")


#: What is tried, and how often against the others.
KINDS: dict[Maker, int] = {
    hand_model: 12,
    hand_file: 8,
    object_mesh: 10,
    command_file: 10,
    solution_file: 8,
    calibration_file: 3,
    record_file: 3,
    shape_text: 5,
    path_argument: 8,
    pose_value: 5,
    command_value: 8,
    far_and_near: 6,
    mesh_value: 6,
    shape_value: 5,
    posture_value: 3,
    command_line: 6,
    pickled_grasps: 6,
    grasps_in_yaml: 4,
    array_of_poses: 4,
    trajectory_file: 4,
    joint_map_file: 3,
    included_model: 3,
    picture: 3,
    record_schema: 3,
}
