"""The command line of other controllers and formats: options that fit together, exit codes, one sentence, files."""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

import clench
from clench.apps.cli.commands.export_import import Format
from clench.apps.cli.inputs import actuators
from clench.apps.cli.main import main
from clench.closing.collision.packed_object import hash_bodies, hash_hand
from clench.execution.drivers.ros2 import RosInterface
from clench.execution.formats.exchange import GraspFormat
from clench.execution.hardware.driver_line import Call
from clench.execution.hardware.hardware_hand import HardwareHand
from clench.models.command_file import load_command
from clench.models.shapes import CollisionSource
from clench.solver.analysis.record import Record
from clench.solver.solution import GraspSolution
from handmade import make_solution


@pytest.fixture
def solution(tmp_path: Path) -> GraspSolution:
    """Return a posture of the built-in hand as the solution of a command, and save it as s.json."""
    hand, obj = clench.Hand.load("robonaut2"), clench.GraspObject.load("ball")
    q = hand.open_angles()
    q[hand.joint_index("index_proximal")] = 0.3
    made = make_solution(
        hand="robonaut2",
        object="ball",
        hand_model="robonaut2",
        object_model="ball",
        geometry_hash=f"{hash_hand(hand, CollisionSource.ENGINE)}+{hash_bodies(obj.bodies, CollisionSource.RAW)}",
        joint_angles=dict(zip(hand.joint_names, hand.coupled(q).tolist(), strict=True)),
        open_angles=dict(zip(hand.joint_names, hand.open_angles().tolist(), strict=True)),
        joint_limits={j.name: (j.lower, j.upper) for j in hand.joints},
        max_penetration=0.0,
        decomposition={"posture": {}, "closing": {}},
        fingers={},
        contacts=(),
    )
    made.save(tmp_path / "s.json")
    return made


def test_choices_are_the_values_of_the_enumerations() -> None:
    from clench.apps.cli.inputs.actuators import Interface

    assert set(Interface.__args__) == set(RosInterface)
    assert set(Format.__args__) == set(GraspFormat)


def test_a_film_without_a_picture_is_told(
    solution: GraspSolution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from clench.execution.simulation.filming import Film

    assert solution.hand == "robonaut2"
    for name in ("__post_init__", "begin", "look", "still"):
        monkeypatch.setattr(Film, name, lambda *_: None)
    main(["execute", str(tmp_path / "s.json"), "--video", str(tmp_path / "a.gif"), "--json"])
    assert "Nothing moved: no picture was written." in json.loads(capsys.readouterr().out)["notes"]
    assert not (tmp_path / "a.gif").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--controller", "c"], "--controller means nothing to --actuator simulated."),
        (["--actuator", "signal", "--joint-map", "j.toml"], "--joint-map means nothing to --actuator signal."),
        (["--actuator", "signal"], "--actuator signal needs --to (file:PATH"),
        (["--actuator", "signal", "--record", "r.db", "--to", "mail:x"], "to: expected file:PATH, tcp:HOST:PORT"),
        (["--actuator", "ros2", "--controller", "a b"], "controller: expected a ROS name such as"),
        (["--actuator", "ros2", "--joint-map", "absent.toml"], "absent.toml: no such file."),
        (["--actuator", "ros2", "--timeout", "0"], "--timeout: expected seconds above 0, got 0."),
        (["--actuator", "orca-mock", "--config", "absent.yaml"], "absent.yaml: no such file."),
        (["--actuator", "orca-mock", "--hold"], "--hold or --lift means nothing to --actuator orca-mock."),
        (["--actuator", "ros2", "--stills", "x"], "--video or --stills means nothing to --actuator ros2."),
        (["--mass", "0.2"], "--mass means nothing without --hold or --lift."),
        (["--hold", "--mass", "-1"], "hold: mass: expected a finite number of at least 0.001 kg, got -1.0."),
        (["--hold", "--friction", "nan"], "hold: friction: expected a finite number above 0, got nan;"),
        (["--object", "mug"], "geometry_hash: the solution was computed for another geometry of object 'mug'"),
        (["--log", "absent/x.mcap"], "absent/x.mcap: cannot be written (no folder 'absent')."),
        (["--out", "absent/x.json"], "absent/x.json: cannot be written (no folder 'absent')."),
        (["--out", "."], ".: cannot be written (it is a folder)."),
    ],
)
def test_bad_input_moves_nothing(
    solution: GraspSolution,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    message: str,
) -> None:
    if "orca-mock" in arguments:
        pytest.importorskip("orca_core")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(HardwareHand, "execute", lambda *_: pytest.fail("moved"))
    assert main(["execute", "s.json", *arguments]) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"clench: error: {message}")
    assert err.count("\n") == 1


def test_a_hand_without_controller_is_a_failed_execution(
    solution: GraspSolution, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("cyclonedds")
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    options = ["--actuator", "ros2", "--interface", "cyclonedds", "--timeout", "0.2", "--controller", "nobody"]
    log = ["--log", str(tmp_path / "x.mcap"), "--out", str(tmp_path / "r.json")]
    assert main(["execute", str(tmp_path / "s.json"), *options, *log, "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert report["reason"].startswith("Not carried out: No controller listens on '/nobody/joint_trajectory'")
    assert report["history"] is None
    assert report["notes"] == ["Nothing was measured on the way: no log was written."]
    assert json.loads((tmp_path / "r.json").read_text()) == report
    assert not (tmp_path / "x.mcap").exists()


def test_the_ready_signal(solution: GraspSolution, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ready, record = tmp_path / "ready.json", tmp_path / "r.db"
    options = ["--actuator", "signal", "--to", f"file:{ready}", "--record", str(record)]
    assert main(["execute", str(tmp_path / "s.json"), *options]) == 0
    assert "done: Recorded as 1 and signalled to" in capsys.readouterr().out
    with Record(record) as recorded:
        assert recorded.read(json.loads(ready.read_text())["id"]) == solution


def test_what_no_finger_touches_is_dropped(
    solution: GraspSolution, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--hold", "--mass", "0.3", "--out", str(tmp_path / "r.json")]
    assert main(["execute", str(tmp_path / "s.json"), *options]) == 1
    printed = " ".join(capsys.readouterr().out.split())
    assert printed.startswith("dropped: Every joint is within")
    assert (
        "hold: 0.3 kg, friction 0.6, torsion 0.02 m, 3 N for 2 s; it counts as dropped from 50 mm or 15° on" in printed
    )
    assert "Nothing touches the object." in printed
    held = json.loads((tmp_path / "r.json").read_text())["hold"]
    assert held["held"] is False
    assert held["settings"]["mass"] == 0.3
    assert any(not pulled["held"] for pulled in held["pulls"].values())


def test_a_hand_in_the_table_is_not_lifted_and_no_motion_is_made_up(
    solution: GraspSolution, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    replace(solution, hand_pose=clench.Pose([0.5, 0.0, -0.2])).save(tmp_path / "s.json")
    assert main(["execute", str(tmp_path / "s.json"), "--lift", "--out", str(tmp_path / "r.json")]) == 1
    printed = " ".join(capsys.readouterr().out.split())
    assert printed.startswith("not tested: Every joint is within")
    assert "Not tested: the hand would be" in printed
    assert "mm deep in the table." in printed
    assert "squeeze alone" not in printed
    held = json.loads((tmp_path / "r.json").read_text())["hold"]
    assert (held["held"], held["closed"], held["squeezed"], held["pulls"]) == (False, None, None, {})


def test_next_steps_are_carried_out_unless_told_otherwise(
    solution: GraspSolution, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(tmp_path / "s.json")
    replace(solution, next_steps=({"index_proximal": 0.5}, {"thumb_roll": -0.2})).save(file)
    assert main(["execute", file]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "Next step 1 was reached" in printed
    assert "next steps" in printed
    assert main(["execute", file, "--json"]) == 0
    steps = json.loads(capsys.readouterr().out)["next_steps"]
    assert [list(step["joints"]) for step in steps] == [["index_proximal"], ["thumb_roll"]]
    assert steps[0]["joints"]["index_proximal"]["reached"] == pytest.approx(0.5, abs=1e-3)
    assert main(["execute", file, "--skip-next-steps", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["next_steps"] == []


@pytest.mark.parametrize(
    ("step", "message"),
    [
        ({"indx_proximal": 0.5}, "Joint 'indx_proximal' is not in hand 'robonaut2'. Did you mean 'index_proximal'?"),
        (
            {"index_proximal": 5.0},
            "next_steps[1].index_proximal: 5 rad is outside the joint's limits [0, 1.65806] rad.",
        ),
    ],
)
def test_a_next_step_that_cannot_be_taken_moves_nothing(
    solution: GraspSolution,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    step: dict[str, float],
    message: str,
) -> None:
    replace(solution, next_steps=({}, step)).save(tmp_path / "s.json")
    monkeypatch.setattr(clench.SimulatedHand, "execute", lambda *_: pytest.fail("moved"))
    assert main(["execute", str(tmp_path / "s.json")]) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"clench: error: {message}")
    assert err.count("\n") == 1


def test_the_simulated_hand_is_logged(solution: GraspSolution, tmp_path: Path) -> None:
    pytest.importorskip("mcap_ros2")
    log = tmp_path / "x.mcap"
    main(["execute", str(tmp_path / "s.json"), "--log", str(log), "--json"])
    from mcap.reader import make_reader

    with log.open("rb") as stream:
        counts = make_reader(stream).get_summary().statistics.channel_message_counts
    assert max(counts.values()) > 20


@pytest.mark.parametrize("ending", ["yaml", "npy", "json"])
def test_export_and_import(
    solution: GraspSolution, tmp_path: Path, capsys: pytest.CaptureFixture[str], ending: str
) -> None:
    file, folder = tmp_path / f"g.{ending}", tmp_path / "commands"
    assert main(["export", str(tmp_path / "s.json"), "--out", str(file), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["schema"], told["file"], told["grasps"]) == ("clench.export/1", str(file), 1)
    assert told["files"] == [str(file)]
    assert main(["import", str(file), "--hand", "robonaut2", "--out", str(folder), "--json"]) == 0
    (command,) = json.loads(capsys.readouterr().out)["commands"]
    assert command["name"] == "grasp_0"
    read = load_command(command["file"])
    assert read.preshape["index_yaw"] == solution.joint_angles["index_yaw"]
    assert "index_proximal" not in read.preshape
    assert read.object_pose == clench.Pose()
    assert main(["import", str(file), "--hand", "patent15", "--out", str(tmp_path / "no")]) == 2
    assert not (tmp_path / "no").exists()
    assert main(["import", str(file), "--hand", "robonaut2", "--out", str(folder), "--grasp", "x"]) == 2
    assert "Grasp 'x' is not in" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["execute", "export", "export without the hand"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"pregrasp": {"index_proximal": 99.0}}, "pregrasp.index_proximal: 99 rad is outside the joint's limits ["),
        ({"pregrasp": {"index": 0.1}}, "Joint 'index' is not in hand 'robonaut2' (pregrasp of the solution). "),
        (
            {"squeeze": {"feasible": True, "offsets": {"index": 0.1}}},
            "Joint 'index' is not in hand 'robonaut2' (squeeze.offsets of the solution). ",
        ),
    ],
)
def test_edited_angles_are_refused(
    solution: GraspSolution,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    command: str,
    change: dict,
    message: str,
) -> None:
    document = solution.to_dict() | change
    if "pregrasp" in change:
        document["pregrasp"] = solution.joint_angles | change["pregrasp"]
    if command == "export without the hand":
        document["hand_model"] = ""
    (tmp_path / "s.json").write_text(json.dumps(document))
    more = [] if command == "execute" else ["--out", str(tmp_path / "g.yaml")]
    assert main([command.split()[0], str(tmp_path / "s.json"), *more]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "g.yaml").exists()


def test_names_that_lead_elsewhere_are_refused(
    solution: GraspSolution, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["export", str(tmp_path / "s.json"), "--out", str(tmp_path / "g.yaml")])
    text = (tmp_path / "g.yaml").read_text().replace("grasp_0", "../grasp_0")
    (tmp_path / "g.yaml").write_text(text)
    assert main(["import", str(tmp_path / "g.yaml"), "--hand", "robonaut2", "--out", str(tmp_path / "c")]) == 2
    assert "the name cannot be that of a file" in capsys.readouterr().err
    assert not (tmp_path / "grasp_0.json").exists()


class Servos:
    """Go at once where they are told; a signal comes with the fifth command."""

    name = "servos"
    one_target = True
    limits = clench.DriverLimits()

    def __init__(self, joints: list[str], number: int) -> None:
        self.joints, self.number = tuple(joints), number
        self.angles = dict.fromkeys(joints, 0.0)
        self.calls: list[str] = []

    def connect(self, timeout: float) -> None:
        pass

    def read(self) -> clench.HandState:
        return clench.HandState(dict(self.angles))

    def command(self, path: clench.JointPath) -> None:
        self.calls.append("command")
        self.angles.update(path.at(path.period))
        if len(self.calls) == 5:
            signal.pthread_kill(threading.main_thread().ident or 0, self.number)
            time.sleep(0.1)  # the main thread, which waits for this call, has the signal now

    def stop(self) -> None:
        self.calls.append("stop")

    def disconnect(self) -> None:
        pass


@pytest.mark.usefixtures("hangups_heard")
@pytest.mark.parametrize("swallow", [False, True])
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_stops_the_hand_and_what_was_sent_is_kept(
    solution: GraspSolution,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    number: int,
    swallow: bool,
) -> None:
    """Also when the code that happens to run takes the interrupt for an error of its own, and goes on."""
    hand = clench.Hand.load("robonaut2")
    servos = Servos([joint.name for joint in hand.joints], number)
    monkeypatch.setattr(actuators, "_driver", lambda *_: servos)
    if swallow:
        wait = Call.wait

        def swallowing(call: Call, limit: float | None) -> bool:
            with suppress(KeyboardInterrupt):
                return wait(call, limit)
            return wait(call, limit)

        monkeypatch.setattr(Call, "wait", swallowing)
    options = ["--actuator", "ros2", "--speed", "0.2", "--out", str(tmp_path / "r.json"), "--json"]
    code = main(["execute", str(tmp_path / "s.json"), *options])
    report = json.loads((tmp_path / "r.json").read_text())
    printed = capsys.readouterr()
    assert json.loads(printed.out) == report
    assert not report["success"]
    assert report["sent"]["commands"] == 5
    assert servos.calls[:5] == ["command"] * 5
    assert set(servos.calls[5:]) == {"stop"}  # once more where a busy machine lets the first call take too long
    assert len(report["history"]["times"]) >= 5
    seen = "The hand was told to stop: it was seen to stand still."
    if swallow:
        assert code == 1
        assert report["reason"] == f"Stopped on request. {seen}"
    else:
        assert code == 130
        assert report["reason"] == f"Interrupted (KeyboardInterrupt). {seen}"
        assert printed.err == "clench: error: interrupted.\n"


def test_an_interrupt_before_anything_moves_leaves_no_report(
    solution: GraspSolution, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(clench, "execute", interrupted)
    monkeypatch.setattr(actuators, "_driver", lambda *_: Servos([], 0))
    options = ["--actuator", "ros2", "--out", str(tmp_path / "r.json")]
    assert main(["execute", str(tmp_path / "s.json"), *options]) == 130
    assert capsys.readouterr().err == "clench: error: interrupted.\n"
    assert not (tmp_path / "r.json").exists()


def test_the_grasps_of_a_plan_are_exported(solution: GraspSolution, tmp_path: Path, capsys) -> None:
    plan = {"schema": "clench.plan/1", "grasps": [{"solution": solution.to_dict()}] * 2}
    file = tmp_path / "plan.json"
    file.write_text(json.dumps(plan))
    assert main(["export", str(file), "--out", str(tmp_path / "g.yaml"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["grasps"] == 2
    assert main(["execute", str(file)]) == 2
    told = (
        "expected 'clench.solution/1', got 'clench.plan/1'. Give the file of one of the plan's grasps, such as grasp-01"
    )
    assert told in capsys.readouterr().err
    file.write_text(json.dumps({"schema": "clench.plan/1"}))
    assert main(["export", str(file), "--out", str(tmp_path / "g.yaml")]) == 2
    assert "grasps: expected a list of planned grasps." in capsys.readouterr().err
