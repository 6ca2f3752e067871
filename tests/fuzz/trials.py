"""Trials of every kind: a spoiled input, what is done with it, and what a message about it must name."""

import json
import os
import shutil
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import clench
from clench.core.pose import Pose

from .mutation import NUMBERS, TEXTS, VALUES, Rng, pick, spoil_bytes, spoil_text, spoil_tree, to_json
from .originals import CALIBRATION, COMMAND, HAND_FILE, MJCF, SHAPES, URDF, link_stl, mesh_files
from .outcomes import Trial, WrongAnswerError

Maker = Callable[[Rng, Path], Trial]

#: Share of what loads that is solved with.
SOLVED = 0.25


@lru_cache(maxsize=1)
def good() -> tuple[clench.Hand, clench.GraspObject, clench.GraspSolution, dict[str, bytes]]:
    """Return the hand, object and solution that nothing is wrong with, and the mesh files."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        model = model_in(Path(folder), URDF)
        hand = clench.Hand.load(model)
    obj = clench.GraspObject.load("sphere:r=0.02")
    command = clench.GraspCommand(hand_pose=Pose([0.0, 0.0, -0.05]), planes=2, preshape="open")
    return hand, obj, clench.solve(hand, obj, command), mesh_files()


def model_in(folder: Path, text: str, suffix: str = ".urdf") -> Path:
    """Write a model and its mesh into a folder; return its path."""
    model = folder / f"pincer{suffix}"
    model.write_text(text, encoding="utf-8")
    (folder / "link.stl").write_bytes(link_stl())
    return model


def solved(hand: clench.Hand, obj: clench.GraspObject, rng: Rng) -> Any:
    """Return a solution's document, for a random pose near the object."""
    command = clench.GraspCommand(
        hand_pose=Pose(rng.normal(scale=0.05, size=3)), planes=int(rng.integers(1, 4)), preshape="open"
    )
    return document_of(clench.solve(hand, obj, command))


def document_of(solution: clench.GraspSolution) -> dict[str, Any]:
    """Return a solution's document, after it has judged itself and been read again."""
    solution.violations()
    document = solution.to_dict()
    if clench.GraspSolution.from_dict(json.loads(json.dumps(document, allow_nan=False))).to_dict() != document:
        raise WrongAnswerError("the document changes when it is read again")
    return document


def hand_model(rng: Rng, folder: Path) -> Trial:
    text, suffix = pick(rng, [(URDF, ".urdf"), (MJCF, ".xml")])
    model = model_in(folder, text, suffix)
    if rng.random() < 0.1:
        (folder / "link.stl").write_bytes(spoil_bytes(rng, link_stl()))
    else:
        model.write_bytes(spoil_text(rng, text))
    solves = rng.random() < SOLVED

    def run() -> Any:
        hand = clench.Hand.load(model)
        return [hand, solved(hand, good()[1], rng) if solves else None]

    return Trial("hand model", run, ("pincer", "palm", "index", "thumb", "link", "joint", "tendons"))


def hand_file(rng: Rng, folder: Path) -> Trial:
    model, file = model_in(folder, URDF), folder / "pincer.hand.toml"
    file.write_bytes(spoil_text(rng, HAND_FILE))
    solves = rng.random() < SOLVED

    def run() -> Any:
        hand = clench.Hand.load(model, hand_file=file)
        return [hand, solved(hand, good()[1], rng) if solves else None]

    return Trial("hand file", run, ("pincer.hand.toml", "pincer"))


def object_mesh(rng: Rng, folder: Path) -> Trial:
    files = good()[3]
    kind = pick(rng, list(files))
    path = folder / f"thing.{kind.partition('_')[0]}"
    data = files[kind]
    spoiled = spoil_text(rng, data.decode("latin-1")) if kind in ("obj", "off", "stl_ascii", "ply_ascii") else data
    path.write_bytes(spoil_bytes(rng, data) if spoiled is data or rng.random() < 0.2 else spoiled)
    solves, scale = rng.random() < SOLVED, float(pick(rng, [1.0, 1.0, 1e-3, 1e3]))

    def run() -> Any:
        obj = clench.GraspObject.load(path, scale=scale)
        return [obj, solved(good()[0], obj, rng) if solves else None]

    return Trial("object mesh", run, ("thing",))


def command_file(rng: Rng, folder: Path) -> Trial:
    path = folder / "command.json"
    if rng.random() < 0.7:
        tree = spoil_tree(rng, COMMAND)
        path.write_bytes(
            to_json(spoil_tree(rng, tree) if rng.random() < 0.3 and isinstance(tree, dict) else tree).encode()
        )
    else:
        path.write_bytes(spoil_text(rng, json.dumps(COMMAND, indent=1)))

    def run() -> Any:
        command = clench.load_command(path)
        hand, obj, _, _ = good()
        if command.planes > 100 or command.rounds > 20 or len(command.open_variants) * len(command.yaw_grid) > 20:
            return None
        return document_of(clench.solve(hand, obj, command))

    return Trial("command file", run, ("command.json", *COMMAND, *("index", "thumb", "palm")))


def solution_file(rng: Rng, folder: Path) -> Trial:
    path = folder / "solution.json"
    document = good()[2].to_dict()
    path.write_bytes(
        to_json(spoil_tree(rng, document)).encode()
        if rng.random() < 0.8
        else spoil_text(rng, json.dumps(document, indent=1))
    )

    def run() -> Any:
        solution, hand = clench.GraspSolution.load(path), good()[0]
        document = document_of(solution)
        return [
            document,
            _or_error(lambda: clench.plan_trajectory(solution, hand)),
            _or_error(lambda: _linear(solution)),
        ]

    def _linear(solution: clench.GraspSolution) -> Any:
        hand, obj, _, _ = good()
        return clench.sensitivity(solution, hand, obj).to_dict()

    return Trial("solution file", run, ("solution.json",))


def _or_error(call: Callable[[], Any]) -> Any:
    try:
        return call()
    except clench.ClenchError as error:
        if len(str(error)) < 15:
            raise WrongAnswerError(f"says nothing: {error}") from None
        return None


def calibration_file(rng: Rng, folder: Path) -> Trial:
    path = folder / "weights.toml"
    path.write_bytes(spoil_text(rng, CALIBRATION))

    def run() -> Any:
        hand, obj, _, _ = good()
        command = clench.GraspCommand(hand_pose=Pose([0.0, 0.0, -0.05]), planes=1, criteria=path, preshape="open")
        return document_of(clench.solve(hand, obj, command))

    return Trial("calibration file", run, ("weights.toml",))


def record_file(rng: Rng, folder: Path) -> Trial:
    path = folder / "solves.sqlite"
    with clench.Record(path) as record:
        record.extend([good()[2]] * 3)
    path.write_bytes(spoil_bytes(rng, path.read_bytes()))
    for other in folder.glob("solves.sqlite-*"):
        other.unlink()

    def run() -> Any:
        with clench.Record(path) as record:
            found = record.find(limit=5)
            answers = [_or_error(lambda: document_of(record.read(2)))]
            record.append(good()[2])
            return [len(found), len(record), answers]

    return Trial("record", run, ("solves.sqlite", "solve"))


def shape_text(rng: Rng, folder: Path) -> Trial:
    text = spoil_text(rng, pick(rng, SHAPES)).decode("utf-8", errors="replace")
    scale = pick(rng, VALUES) if rng.random() < 0.2 else 1.0
    solves = rng.random() < SOLVED

    def run() -> Any:
        obj = clench.GraspObject.load(text, scale=scale)
        return [obj, solved(good()[0], obj, rng) if solves else None]

    return Trial("shape text", run)


def path_argument(rng: Rng, folder: Path) -> Trial:
    path = odd_path(rng, folder)
    load: Callable[[Any], Any] = pick(
        rng,
        [
            clench.Hand.load,
            clench.GraspObject.load,
            clench.load_command,
            clench.GraspSolution.load,
            lambda p: clench.Hand.load("patent15", hand_file=p),
            lambda p: clench.solve(
                *good()[:2], clench.GraspCommand(Pose.identity(), criteria=Path(p), preshape="open")
            ),
            _recorded,
            _saved,
        ],
    )
    return Trial("path", lambda: load(path) and None)


def _recorded(path: str) -> None:
    with clench.Record(path) as record:
        record.append(good()[2])


def _saved(path: str) -> None:
    target = Path(path)
    folder = target.parent
    before = set(os.listdir(folder)) if _is_folder(folder) else set()
    try:
        good()[2].save(path)
    except clench.ClenchError:
        if _is_folder(folder) and set(os.listdir(folder)) != before:
            raise WrongAnswerError("something was left behind") from None
        raise
    clench.GraspSolution.load(path)


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def odd_path(rng: Rng, folder: Path) -> str:
    """Return a path that is not what it should be: a folder, a loop, no file, an empty one, an odd name."""
    suffix = pick(
        rng, [".urdf", ".xml", ".json", ".stl", ".obj", ".ply", ".toml", ".sqlite", "", ".STL", ".txt", ".glb"]
    )
    kind = int(rng.integers(10))
    path = folder / f"odd{suffix}"
    if kind == 0:
        path.mkdir()
    elif kind == 1:
        path.symlink_to(path.name)
    elif kind == 2:
        path.touch()
    elif kind == 3:
        path.symlink_to("nowhere")
    elif kind == 4:
        os.mkfifo(path)
    elif kind == 5:
        path.write_bytes(rng.bytes(int(rng.integers(1, 400))))
    elif kind == 6:
        return str(folder / "missing" / f"odd{suffix}")
    elif kind == 7:
        path.write_text(pick(rng, [URDF, MJCF, HAND_FILE, json.dumps(COMMAND), "{}", "[]", "null", "\n"]))
        if rng.random() < 0.3:
            path.chmod(0)
    else:
        return f"{pick(rng, [str(folder) + '/', ''])}{pick(rng, TEXTS)}{suffix}"
    return str(path)


def emptied(folder: Path) -> Path:
    """Return the folder with nothing in it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def numbers(rng: Rng, count: int) -> Any:
    """Return so many numbers, some of them extreme, as a list or an array."""
    values = rng.normal(scale=float(pick(rng, [1.0, 0.05, 0.05, 0.05, 1e-9, 1e6, 1e150, 1e-150, 1e300])), size=count)
    for _ in range(int(pick(rng, [0, 0, 0, 0, 1, 2]))):
        values[int(rng.integers(count))] = pick(rng, [0.0, -0.0, np.nan, np.inf, -np.inf, 1e308, 5e-324, 1.0])
    return values if rng.random() < 0.5 else values.tolist()


def a_pose(rng: Rng) -> Pose:
    """Return a pose with extreme numbers; many are refused."""
    wxyz = rng.normal(size=4)
    unit = wxyz / np.linalg.norm(wxyz)
    return Pose(numbers(rng, 3), wxyz=unit if rng.random() < 0.95 else numbers(rng, 4))


def number_text(rng: Rng) -> str:
    """Return an extreme number as an argument."""
    return str(pick(rng, NUMBERS))
