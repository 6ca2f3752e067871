"""Read files in processes of their own, with limits on memory and time: a crash or a hang harms nothing else.

`python -m hostile.apart` reads lines of JSON, `[kind, path]`, and answers each with `[exit code, text, seconds]`.
"""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

#: What reading one file may take [bytes], [s].
MEMORY = 2 << 30
SECONDS = 30
#: What does nothing for so long waits for something that never comes [s].
PATIENCE = 300


class Outcome(NamedTuple):
    """Hold what came of reading a file: the exit code (negative: a signal), what was said, and how long it took."""

    code: int
    text: str
    seconds: float


@contextmanager
def reading_apart() -> Iterator[Callable[[str, Path], Outcome]]:
    """Give a function that reads a file in a process of its own; its `kind` is one of `READERS`."""
    with subprocess.Popen(
        [sys.executable, "-m", "hostile.apart"],
        cwd=Path(__file__).parents[1],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as server:
        asked, answers = server.stdin, server.stdout
        assert asked is not None
        assert answers is not None

        def read(kind: str, path: Path) -> Outcome:
            asked.write(json.dumps([kind, str(path)]) + "\n")
            asked.flush()
            return Outcome(*json.loads(answers.readline()))

        yield read


def hand(path: str) -> None:
    from clench.apps.cli.main import main

    raise SystemExit(main(["hand", path]))


def thing(path: str) -> None:
    import clench

    clench.GraspObject.load(path)


def command(path: str) -> None:
    import clench

    clench.load_command(path)


def solve(path: str) -> None:
    from clench.apps.cli.main import main

    raise SystemExit(main(["solve", "--hand", "patent15", "--object", "ball", "--command", path]))


def solution(path: str) -> None:
    import clench

    clench.GraspSolution.load(path)


def execute(path: str) -> None:
    from clench.apps.cli.main import main

    raise SystemExit(main(["execute", path]))


def trajectory(path: str) -> None:
    import clench

    clench.Trajectory.load(path)


def record(path: str) -> None:
    from clench.apps.cli.main import main

    code = main(["record", path])
    raise SystemExit(code or main(["record", path, "--id", "1"]))


def grasps(path: str) -> None:
    from clench.execution.formats.exchange import import_grasps

    import_grasps(path)


def calibration(path: str) -> None:
    from clench.scoring.calibration import load_calibration

    load_calibration(Path(path))


def hand_file(path: str) -> None:
    import clench

    clench.Hand.load("patent15", hand_file=path)


def joint_map(path: str) -> None:
    from clench.execution.hardware.joint_map import JointMap

    JointMap.load(path)


def poses(path: str) -> None:
    from clench.apps.cli.main import main

    raise SystemExit(main(["batch", "--hand", "patent15", "--object", "ball", "--poses", path]))


def export(path: str) -> None:
    from clench.apps.cli.main import main

    out = Path(path).parent / "out.yaml"
    code = main(["export", path, "--out", str(out)])
    if code and out.exists():
        raise AssertionError("something was written")
    raise SystemExit(code)


def examples(path: str) -> None:
    from clench.apps.cli.main import main

    raise SystemExit(main(["calibrate", path]))


def moved(path: str) -> None:
    """Tell a hand in a simulation a trajectory, which must not move it."""
    import clench
    from clench.execution.simulation.simulated_hand import SimulatedHand

    from .data import good_solution

    hand, ball = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    solution = clench.GraspSolution.from_dict(json.loads(good_solution()))
    trajectory = clench.Trajectory.load(path)

    def on_step(*_: Any) -> None:
        raise AssertionError("it moved")

    SimulatedHand(hand, ball, on_step=on_step).execute(solution, trajectory)


_ANSWERS = (hand, solve, execute, record, poses, export, examples)
_LOADERS = (thing, command, solution, trajectory, moved, grasps, calibration, hand_file, joint_map)
READERS: dict[str, Callable[[str], None]] = {read.__name__: read for read in (*_ANSWERS, *_LOADERS)}


@cache
def _good_files() -> dict[str, Callable[[Path], Path]]:
    """Return writers of files that are read without an error, by kind."""
    from fuzz.originals import COMMAND

    from .archives import good_batch
    from .data import record, solution_with
    from .meshes import OBJ, file
    from .models import mjcf

    def batch(folder: Path) -> Path:
        np.savez(folder / "b.npz", **good_batch())
        return folder / "b.npz"

    def rows(folder: Path) -> Path:
        np.save(folder / "poses.npy", np.array([[1.0, 0, 0, 0, 0, 0, -0.05]]))
        return folder / "poses.npy"

    return {
        "hand": mjcf(),
        "thing": file("thing.obj", OBJ),
        "solve": file("command.json", json.dumps({"hand_pose": COMMAND["hand_pose"]})),
        "execute": solution_with(lambda document: None),
        "export": batch,
        "poses": rows,
        "record": record(),
    }


def _prepare(kind: str, folder: Path) -> None:
    """Read a good file of a kind, once: what its reader imports and loads is then there in every child."""
    place = folder / kind
    if kind not in _good_files() or place.exists():
        return
    place.mkdir()
    code = 0
    try:
        READERS[kind](str(_good_files()[kind](place)))
    except SystemExit as end:
        code = int(end.code or 0)
    assert code in (0, 1), f"a good file for {kind!r} ended with {code}"


def _in_child(read: Callable[[str], None], path: str, place: int) -> None:
    """Read a file under limits, and end this process with the exit code that the command line would give."""
    from clench.core.exceptions import ClenchError

    os.dup2(place, 1)
    os.dup2(place, 2)
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        read(path)
        code = 0
    except SystemExit as end:
        code = int(end.code or 0)
    except ClenchError as error:
        os.write(2, f"clench: error: {error}\n".encode())
        code = 2
    except BaseException as error:
        os.write(2, f"{type(error).__name__}: {error}\n".encode()[:1000])
        code = 70
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _outcome(kind: str, path: str, place: int) -> Outcome:
    os.ftruncate(place, 0)
    os.lseek(place, 0, os.SEEK_SET)
    start = time.perf_counter()
    read, child = READERS[kind], os.fork()
    if child == 0:
        _in_child(read, path, place)
    status = None
    while status is None:
        ended, found = os.waitpid(child, os.WNOHANG)
        if ended:
            status = os.waitstatus_to_exitcode(found)
        elif time.perf_counter() - start > PATIENCE:
            os.kill(child, signal.SIGKILL)
            status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        else:
            time.sleep(0.002)
    seconds = time.perf_counter() - start
    os.lseek(place, 0, os.SEEK_SET)
    return Outcome(status, os.read(place, 20_000).decode(errors="replace"), seconds)


def serve() -> None:
    """Answer the lines of standard input."""
    import tempfile

    # What every child needs is loaded once.
    import mujoco  # noqa: F401
    import trimesh  # noqa: F401
    import tyro  # noqa: F401

    import clench
    import clench.models.hand.hand_making
    import clench.models.objects.object_loading

    clench.Hand.load("patent15")
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # where good files are answered
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile() as place:
        os.chdir(folder)  # where engines leave their logs
        for line in sys.stdin:
            kind, path = json.loads(line)
            _prepare(kind, Path(folder))
            outcome = _outcome(kind, path, place.fileno())
            answers.write(json.dumps(outcome) + "\n")
            answers.flush()


if __name__ == "__main__":
    serve()
