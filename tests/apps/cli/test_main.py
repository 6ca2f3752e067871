"""The command line: exit codes, one sentence for bad input, JSON that is only JSON."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

import clench
from clench.apps.cli.command_table import COMMANDS
from clench.apps.cli.commands.demo import MUG_POSE
from clench.apps.cli.inputs import choices
from clench.apps.cli.inputs.command_files import loadable
from clench.apps.cli.main import main
from clench.closing.collision import sizes
from clench.core.defaults import MASS
from clench.core.exceptions import CommandError
from clench.execution.execution_report import ExecutionReport, JointReached
from clench.kernels.runtime import warming
from clench.models.command import ClosingOrder, GraspCommand
from clench.models.shapes import CollisionSource
from clench.solver.analysis.record import Record
from clench.solver.solution import GraspSolution, SolutionStatus
from handmade import make_solution


class FakeSolver:
    """Stand in for loading and solving: remembers what it was asked, gives what it was told."""

    def __init__(self) -> None:
        self.answer = make_solution()
        self.commands: list[GraspCommand] = []
        self.loaded: list[tuple[object, ...]] = []

    def load(self, *arguments: object, **options: object) -> SimpleNamespace:
        self.loaded.append((*arguments, options))
        return SimpleNamespace(
            name="pincer", warnings=("looks like [millimetres]",), open_angles=dict, joints=(), couplings=()
        )

    def solve(self, hand: object, obj: object, command: GraspCommand) -> GraspSolution:
        self.commands.append(command)
        return self.answer


@pytest.fixture
def solver(monkeypatch: pytest.MonkeyPatch) -> FakeSolver:
    fake = FakeSolver()
    loader = SimpleNamespace(load=fake.load)
    monkeypatch.setitem(vars(clench), "Hand", loader)
    monkeypatch.setitem(vars(clench), "GraspObject", loader)
    monkeypatch.setitem(vars(clench), "solve", fake.solve)
    there = GraspCommand(hand_pose=clench.Pose([0.0, 0.0, 0.1]), planes=1)
    planned = SimpleNamespace(command=there, preshape="open", hand_pose=there.hand_pose, epsilon=0.1)
    monkeypatch.setitem(vars(clench), "plan_grasps", lambda *_, **__: [planned])
    monkeypatch.setitem(vars(clench.execution), "complete", lambda solution, *_, **__: solution)
    monkeypatch.setattr(sizes, "warn_of_size", lambda *_: None)
    monkeypatch.setattr("clench.apps.cli.output.printing.print_closure", lambda *_: None)
    # Nothing is computed: nothing is compiled or said to be, whatever the cache on disk holds.
    monkeypatch.setattr(warming, "warm_up", lambda **_: None)
    return fake


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> None:
    def draw(hand: object, obj: object, command: object, solution: object, folder: Path) -> list[Path]:
        (folder / "figure.png").write_bytes(b"x")
        return [folder / "figure.png"]

    def write(path: Path, *_: object) -> Path:
        path.write_text("a page")
        return path

    monkeypatch.setitem(sys.modules, "clench.apps.figures", SimpleNamespace(draw_solution=draw))
    monkeypatch.setitem(vars(clench), "write_page", write)
    monkeypatch.setattr(
        "clench.execution.trajectory.plan_trajectory", lambda *_, **__: SimpleNamespace(save=Path.touch)
    )


SOLVE = ["solve", "--hand", "pincer", "--object", "ball"]


@pytest.mark.parametrize(("given", "then"), [(None, "4"), ("20", "20")])
def test_the_waiting_of_blas_threads_is_set_before_numpy_loads(given: str | None, then: str) -> None:
    """Every thread of OpenBLAS waits in a loop once it has started, which takes a tenth of a short command's time."""
    program = (
        "import os, sys\n"
        "class Watch:\n"
        "    def find_spec(self, name, *rest):\n"
        "        if name == 'numpy': print('numpy', os.environ.get('OPENBLAS_THREAD_TIMEOUT'))\n"
        "sys.meta_path.insert(0, Watch())\n"
        "from clench.apps.cli.main import main\n"
        "main(['object', 'sphere:r=0.03'])\n"
    )
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_THREAD_TIMEOUT"}
    environment |= {} if given is None else {"OPENBLAS_THREAD_TIMEOUT": given}
    run = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert [line for line in run.stdout.splitlines() if line.startswith("numpy ")] == [f"numpy {then}"]


def test_help_loads_nothing_heavy_and_names_every_command() -> None:
    """What takes time is loading; a clock would tell how busy the machine is."""
    heavy = ("numpy", "numba", "scipy", "mujoco", "trimesh", "matplotlib")
    program = (
        "import sys; from clench.apps.cli.main import main; code = main(['--help']); "
        f"print([name for name in {heavy!r} if name in sys.modules]); sys.exit(code)"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "[]"
    for name in COMMANDS:
        assert f"\n  {name} " in run.stdout


@pytest.mark.parametrize(
    ("hand_pose", "more"),
    [
        ({"position": [0, 0, 0.1], "wxyz": [1, 0, 0, 0]}, ()),
        ({"position": [-0.05, -0.1, 0.06], "wxyz": [0.5, 0.5, 0.5, 0.5]}, ("numpy.ma",)),
    ],
)
def test_a_printed_solution_loads_no_package_that_it_does_not_need(tmp_path: Path, hand_pose, more) -> None:
    """Loading one of these takes about as long as computing the solution."""
    path = tmp_path / "C.json"
    path.write_text(json.dumps({"hand_pose": hand_pose, "preshape": "open"}))
    needless = ("typeguard", "asyncio", "unittest.mock", "glfw.library", "scipy.optimize", "scipy.spatial")
    needless += ("matplotlib", "trimesh", "clarabel", "coacd", "PIL", *more)
    program = (
        "import sys; from clench.apps.cli.main import main; "
        f"main(['solve', '--hand', 'robonaut2', '--object', 'mug', '--command', {str(path)!r}]); "
        f"print([name for name in {needless!r} if name in sys.modules])"
    )
    for _ in range(2):  # the first one may make what is kept of a hand, which takes more
        run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "[]"


def test_the_end_of_a_command_looks_for_no_garbage() -> None:
    program = """
import sys
from clench.apps.cli.main import main
class Ring:
    def __init__(self): self.own = self
    def __del__(self, say=sys.stdout.write): say("collected")
main(["--version"])
Ring()
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout == f"clench {clench.__version__}\n"


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "--help"]) == 0
    out = capsys.readouterr().out
    assert f"usage: clench {name}" in out
    assert name == "bench" or "--json" in out
    assert "--no-" not in out


def test_choices_are_the_values_of_the_enumerations() -> None:
    assert set(choices.Source.__args__) == set(CollisionSource)
    assert set(choices.Order.__args__) == set(ClosingOrder)
    assert set(choices.Status.__args__) == set(SolutionStatus)


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"clench {clench.__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["solv"], "clench: error: Command 'solv' is not in clench. Did you mean 'solve'?"),
        (["hand", "robonaut3"], "clench: error: Hand 'robonaut3' is not"),
        (["object", "cup"], "clench: error: Object 'cup' is not in the built-in objects"),
        (["object", "ball", "--scale", "-1"], "clench: error: scale: expected a finite number above 0, got -1.0."),
        (
            ["object", "mug", "--center-of-mass", "0", "0", "1"],
            "clench: error: center_of_mass: [0.0, 0.0, 1.0] is not inside of the convex hull of mug, ",
        ),
        (["execute", "absent.json"], "clench: error: absent.json: no such file."),
        (["record", "absent.db"], "clench: error: absent.db: no such record."),
        (["solve", "--hand", "robonaut2", "--object", "absent.obj"], "clench: error: "),
        (
            ["solve", "--hand", "robonaut2", "--object", "ball", "--criteria", "stedy"],
            "clench: error: Preset 'stedy' is not in clench's criteria presets (a file is named with its ending). "
            "Did you mean 'steady'?",
        ),
        (
            ["solve", "--hand", "robonaut2", "--object", "ball", "--criteria", "absent.toml"],
            "clench: error: absent.toml: no such calibration file; presets, by name alone: balanced, gentle, quick",
        ),
    ],
)
def test_bad_input_is_one_sentence(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith(message)
    assert captured.err.count("\n") == 1
    assert captured.out == ""


@pytest.mark.parametrize("arguments", [["solve"], ["solve", "--planes", "many"], ["hand"], [*SOLVE, "--oder", "x"]])
def test_wrong_arguments_exit_with_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_debug_shows_where(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(clench.FileError):
        main(["execute", "absent.json", "--debug"])


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [
        (KeyError("x\ny"), 70, r"clench: error: internal error (KeyError: 'x\ny'); run again with --debug"),
        (KeyboardInterrupt(), 130, "clench: error: interrupted."),
        (CommandError("planes: bad."), 2, "clench: error: planes: bad."),
    ],
)
def test_no_error_gives_a_traceback(
    solver: FakeSolver,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: BaseException,
    code: int,
    text: str,
) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setitem(vars(clench), "solve", fail)
    assert main(SOLVE) == code
    captured = capsys.readouterr()
    assert captured.err.startswith(text)
    assert captured.err.count("\n") == 1
    if code == 70:
        with pytest.raises(KeyError):
            main([*SOLVE, "--debug"])


@pytest.mark.parametrize(
    ("status", "code", "strict"),
    [("grasp", 0, 0), ("partial", 0, 1), ("no_contact", 1, 1), ("blocked", 1, 1)],
)
def test_exit_codes_of_answers(
    solver: FakeSolver, capsys: pytest.CaptureFixture[str], status: str, code: int, strict: int
) -> None:
    solver.answer = make_solution(status=SolutionStatus(status))
    assert main(SOLVE) == code
    assert main([*SOLVE, "--strict"]) == strict
    assert status in capsys.readouterr().out


def test_solve_prints_json_that_loads(solver: FakeSolver, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SOLVE, "--json"]) == 0
    loaded = GraspSolution.from_dict(json.loads(capsys.readouterr().out))
    assert loaded == replace(solver.answer, hand_model="pincer", object_model="ball")


def test_solve_prints_a_table(
    solver: FakeSolver, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    solver.answer = make_solution(max_penetration=0.002)
    assert main(SOLVE) == 0
    out = capsys.readouterr().out
    assert "partial: index touches, thumb does not" in out
    assert "violation: The hand penetrates the object by 0.002 m" in out
    assert "warning: looks like [millimetres]" in out
    assert "full width" in out
    assert "19.1 11.5" in out  # the angles of the index in degrees
    assert "no closing joint can move" in out


def test_solve_without_command_plans_one_grasp(solver: FakeSolver, monkeypatch: pytest.MonkeyPatch) -> None:
    planned, asked = clench.plan_grasps, list[object]()

    def plan_grasps(hand: object, obj: object, count: int, **options: object) -> object:
        asked.append((count, options))
        return planned(hand, obj, count)

    monkeypatch.setitem(vars(clench), "plan_grasps", plan_grasps)
    solver.answer = make_solution(status=SolutionStatus.GRASP)
    arguments = ["--seed", "5", "--planes", "3", "--order", "proximal-first", "--scale", "0.001", "--palm", "p"]
    main([*SOLVE, *arguments, "--friction", "0.4"])
    (command,) = solver.commands
    assert command == GraspCommand(hand_pose=clench.Pose([0, 0, 0.1]), seed=5, planes=3)
    assert asked == [(1, {"mass": MASS, "friction": 0.4, "seed": 5, "path": False})]
    assert solver.loaded[0] == ("pincer", {"hand_file": None, "palm": "p", "collision_source": None})
    assert solver.loaded[1] == ("ball", {"scale": 0.001})


def test_solve_without_command_says_why_there_is_no_grasp(capsys: pytest.CaptureFixture[str]) -> None:
    few = ["solve", "--hand", "robonaut2", "--object", "sphere:r=0.001"]
    assert main(few) == 1
    assert "too few fingers touch" in capsys.readouterr().out
    assert main([*few, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["grasps"] == []


def test_plan_prints_a_table_writes_files_and_one_document(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    plan = ["plan", "--hand", "robonaut2", "--object", "ball", "--count", "2", "--effort", "16"]
    assert main([*plan, "--out", str(tmp_path / "new")]) == 0
    out = capsys.readouterr().out
    assert "Found 2 of 2 grasps from 64 proposals." in out
    solution = clench.GraspSolution.load(tmp_path / "new" / "grasp-01.json")
    assert solution.is_valid()
    assert (tmp_path / "new" / "grasp-02-trajectory.json").is_file()
    written = json.loads((tmp_path / "new" / "plan.json").read_text())
    assert main([*plan, "--json", "--without-path"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [g["solution"]["joint_angles"] for g in document["grasps"]] == [
        g["solution"]["joint_angles"] for g in written["grasps"]
    ]
    assert document["hand"] == "robonaut2"
    assert document["seconds"]["total"] > 0.0


def test_solve_with_a_command_file(solver: FakeSolver, tmp_path: Path) -> None:
    file = tmp_path / "c.json"
    file.write_text(json.dumps({"hand_pose": {"position": [0, 0, 1]}, "planes": 7}))
    assert main([*SOLVE, "--command", str(file)]) == 0
    assert main([*SOLVE, "--command", str(file), "--planes", "2"]) == 0
    assert [c.planes for c in solver.commands] == [7, 2]
    assert solver.commands[0].hand_pose == clench.Pose([0, 0, 1])


@pytest.mark.parametrize("verb", ["solve", "batch"])
@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"criteria": {"range_of_motion": -1}}, "criteria.range_of_motion: expected a number of at least 0, got -1"),
        ({"criteria": {"range": 1}}, "Criterion 'range' is not in criteria."),
        ({"criteria": {}}, "criteria: nothing counts in the choice; expected a weight above 0."),
        ({"planes": 0}, "planes: expected"),
    ],
)
def test_what_is_wrong_in_a_command_file_is_said_with_its_name(
    solver: FakeSolver,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    verb: str,
    keys: dict[str, object],
    said: str,
) -> None:
    file = tmp_path / "c.json"
    file.write_text(json.dumps({"hand_pose": {"position": [0, 0, 1]}, **keys}))
    assert main([verb, *SOLVE[1:], "--command", str(file)]) == 2
    assert capsys.readouterr().err.startswith(f"clench: error: {file}: {said}")
    assert not solver.commands


def test_a_calibration_file_that_a_command_file_names_is_named(
    solver: FakeSolver, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, weights = tmp_path / "c.json", tmp_path / "w.toml"
    file.write_text(json.dumps({"hand_pose": {"position": [0, 0, 1]}, "criteria": "w.toml"}))
    weights.write_text("")
    assert main([*SOLVE, "--command", str(file)]) == 2
    assert capsys.readouterr().err.startswith(f"clench: error: {weights}: nothing counts in the choice;")


CHOICE = {
    "calibration": "quick",
    "criteria": {
        "range_of_motion": {"weight": 1.0, "scale": 2.0, "limit": 3.0, "unit": "rad", "better": "less", "source": "x"}
    },
    "unused": ["next_step_time"],
    "text": "The chosen candidates lead.",
    "total": -0.3,
    "hand_scores": {},
    "final_hand_scores": {},
    "combinations": 3,
    "combinations_tried": 0,
    "proved": True,
    "runner_up": None,
    "fingers": {
        "index": {
            "text": "the full width leads plane 1 by [0.1].",
            "runner_up": 0,
            "lead": 0.1,
            "totals": [-0.4, -0.9, -0.3],
            "pareto": [2],
            "closed_again": True,
        }
    },
}


def test_solve_explains_its_choice(
    solver: FakeSolver, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "160")
    solver.answer = make_solution(choice=CHOICE)
    assert main([*SOLVE, "--explain", "--criteria", "quick"]) == 0
    assert solver.commands[0].criteria == "quick"
    lines = [" ".join(line.replace("│", " ").split()) for line in capsys.readouterr().out.splitlines()]
    assert "range_of_motion rad less 1 2 3" in lines
    assert "*P full 0 0.3 -0.3000 touch" in lines
    assert "2 plane 0 0 0.3 -0.4000 limit" in lines
    assert "x plane 1 0 0.3 -0.9000 touch" in lines
    assert "index: the full width leads plane 1 by [0.1]." in lines
    assert "said nothing about any candidate: next_step_time" in lines
    assert "The chosen candidates lead." in lines
    assert any("closed again" in line for line in lines)


def test_a_solution_without_a_choice_says_so(solver: FakeSolver, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SOLVE, "--explain"]) == 0
    assert "does not say how its candidates were chosen" in capsys.readouterr().out


def test_solve_writes_files_and_record(
    solver: FakeSolver, figures: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, db = tmp_path / "a" / "out", tmp_path / "r.db"
    assert main([*SOLVE, "--out", str(out), "--record", str(db)]) == 0
    assert {p.name for p in out.iterdir()} == {"solution.json", "trajectory.json", "figure.png"}
    printed = capsys.readouterr().out
    assert all(str(p) in printed for p in (*out.iterdir(), db))
    with Record(db) as record:
        assert record.read(1) == GraspSolution.load(out / "solution.json")


def test_a_folder_that_cannot_be_made(
    solver: FakeSolver, figures: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert main([*SOLVE, "--out", str(tmp_path / "file")]) == 2
    assert "cannot be made a folder" in capsys.readouterr().err


def test_models_that_are_files_are_recorded_with_their_whole_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("hand.xml").write_text("")
    assert loadable("hand.xml") == str(tmp_path / "hand.xml")
    assert loadable("mug") == "mug"


@pytest.fixture
def executed(solver: FakeSolver, monkeypatch: pytest.MonkeyPatch) -> Callable[[bool], list[object]]:
    """Return a function that says how executions end, and gives the list of calls."""
    calls: list[object] = []

    def prepare(success: bool) -> list[object]:
        report = ExecutionReport("simulated", success, "because", {"index_curl": JointReached(0.5, 0.25)})
        monkeypatch.setitem(vars(clench), "SimulatedHand", lambda *_, **__: "hand")
        monkeypatch.setitem(vars(clench), "execute", lambda *a, **k: calls.append((*a, k)) or report)
        return calls

    return prepare


@pytest.mark.parametrize(("success", "code"), [(True, 0), (False, 1)])
def test_execute(
    executed: Callable[[bool], list[object]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    success: bool,
    code: int,
) -> None:
    make_solution().save(tmp_path / "s.json")
    calls = executed(success)
    arguments = ["execute", str(tmp_path / "s.json"), "--speed", "0.5", "--force", "--out", str(tmp_path / "r.json")]
    assert main([*arguments, "--json"]) == code
    assert calls == [(make_solution(), "hand", {"speed": 0.5, "force": True, "next_steps": True})]
    document = json.loads(capsys.readouterr().out)
    assert document == json.loads((tmp_path / "r.json").read_text())
    assert document["success"] is success
    assert main(arguments) == code
    assert "-14.324" in capsys.readouterr().out
    assert main([*arguments, "--strict"]) == 1  # partial only


def test_execute_needs_to_know_the_models(
    executed: Callable[[bool], list[object]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    executed(True)
    make_solution(object_model="").save(tmp_path / "s.json")
    assert main(["execute", str(tmp_path / "s.json")]) == 2
    assert "object_model: the solution does not name it; give --object." in capsys.readouterr().err
    assert main(["execute", str(tmp_path / "s.json"), "--object", "ball"]) == 0


def test_record_lists_and_shows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    db = tmp_path / "r.db"
    with Record(db) as record:
        record.extend([make_solution(), make_solution(hand="other", status=SolutionStatus.GRASP)])
    assert main(["record", str(db), "--json"]) == 0
    assert [s["id"] for s in json.loads(capsys.readouterr().out)["solves"]] == [2, 1]
    assert main(["record", str(db), "--status", "grasp"]) == 0
    out = capsys.readouterr().out
    assert "1 of 2 solves" in out
    assert "other" in out
    assert main(["record", str(db), "--id", "1", "--json"]) == 0
    assert GraspSolution.from_dict(json.loads(capsys.readouterr().out)) == make_solution()
    assert main(["record", str(db), "--id", "1"]) == 0
    assert "pincer on ball" in capsys.readouterr().out
    assert main(["record", str(db), "--id", "9"]) == 2
    assert "Solve '9' is not in record" in capsys.readouterr().err


def test_hand(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert main(["hand", "robonaut2", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [f["name"] for f in document["fingers"]] == ["thumb", "index", "middle", "ring", "little"]
    assert main(["hand", "robonaut2"]) == 0
    out = capsys.readouterr().out
    assert "thumb_proximal" in out
    assert "coupled joints" in out


def test_object(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert main(["object", "box:x=0.1,y=0.05,z=0.03", "--scale", "2", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "clench.object/1"
    assert document["size"] == pytest.approx([0.2, 0.1, 0.06])
    assert len(document["stable_poses"]) == 6
    assert main(["object", "cylinder:r=0.03,h=0.1", "--center-of-mass", "0", "0", "0.04"]) == 0
    out = capsys.readouterr().out
    assert "[0, 0, 0.04] m" in out
    assert "stable poses on a table, 3 of 3" in out
    (tmp_path / "[flat].obj").write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n")
    assert main(["object", str(tmp_path / "[flat].obj")]) == 0
    out = capsys.readouterr().out
    assert "no stable pose: [flat]: expected a solid, but the object is flat" in out
    assert "warning: [flat].obj: not watertight" in out


def test_bench_is_handed_its_own_arguments(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[list[str]] = []
    monkeypatch.setattr("benchmarks.bench_commands.main", lambda arguments: seen.append(arguments) or 3)
    assert main(["bench", "solve", "--poses", "3", "--json"]) == 3
    assert seen == [["solve", "--poses", "3", "--json"]]


def test_demo_plans_a_grasp_and_leaves_files(
    executed: Callable[[bool], list[object]],
    solver: FakeSolver,
    figures: None,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = executed(True)
    solver.answer = make_solution(status=SolutionStatus.GRASP)
    assert main(["demo", "--out", str(tmp_path / "out"), "--seed", "0", "--json"]) == 0
    captured = capsys.readouterr()
    solution = GraspSolution.from_dict(json.loads(captured.out))
    assert solution.status is SolutionStatus.GRASP
    assert (solution.hand_model, solution.object_model) == ("robonaut2", "mug")
    assert calls[0][0] == solution
    names = {"solution.json", "trajectory.json", "figure.png", "execution.json", "grasp.html", "record.sqlite"}
    assert names <= {p.name for p in (tmp_path / "out").iterdir()}


def test_demo_keeps_a_pose_for_the_built_in_hand_and_mug(
    executed: Callable[[bool], list[object]], solver: FakeSolver, figures: None, tmp_path: Path
) -> None:
    executed(True)
    assert main(["demo", "--out", str(tmp_path / "out")]) == 0
    assert {command.hand_pose for command in solver.commands} == {MUG_POSE}
    assert main(["demo", "--out", str(tmp_path / "out"), "--object", "ball"]) == 0
    assert MUG_POSE not in {command.hand_pose for command in solver.commands[2:]}


def test_demo_fails_when_the_simulated_hand_does(
    executed: Callable[[bool], list[object]], solver: FakeSolver, figures: None, tmp_path: Path
) -> None:
    executed(False)
    assert main(["demo", "--out", str(tmp_path / "out")]) == 1


def test_output_that_nobody_reads_is_no_error() -> None:
    program = "import sys; from clench.apps.cli.main import main; sys.exit(main(['hand', 'robonaut2', '--json']))"
    run = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    run.stdout.close()
    assert run.wait(timeout=60) == 0
    assert run.stderr.read() == b""
    run.stderr.close()


def test_friction_or_mass_alone_print_the_forces(capsys):
    assert main(["solve", "--hand", "robonaut2", "--object", "sphere:r=0.03", "--friction", "0.9"]) in (0, 1)
    said = capsys.readouterr().out
    assert "epsilon" in said
    assert "any direction of gravity" in said or "every direction of gravity" in said
    assert main(["solve", "--hand", "robonaut2", "--object", "sphere:r=0.03", "--mass", "-1"]) == 2
    assert "--mass: expected a finite number of at least 0 kg" in capsys.readouterr().err


@pytest.mark.parametrize(("outcomes", "code"), [([True, True], 0), ([True, False], 1)])
def test_a_plan_with_a_dropped_object_exits_with_1(monkeypatch, capsys, outcomes, code):
    from types import SimpleNamespace

    from clench.apps.cli.commands import plan_command

    reports = iter([SimpleNamespace(held=held, to_dict=lambda held=held: {"held": held}) for held in outcomes])
    monkeypatch.setattr(plan_command, "_held", lambda *_: next(reports))
    call = ["plan", "--hand", "robonaut2", "--object", "ball", "--count", "2", "--effort", "16", "--without-path"]
    assert main([*call, "--hold", "--json"]) == code
    document = json.loads(capsys.readouterr().out)
    assert [grasp["hold"]["held"] for grasp in document["grasps"]] == outcomes
