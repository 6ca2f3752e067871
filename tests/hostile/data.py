"""Commands, solutions, grasps, records and arrays that were made to do harm, by name: how each is read, and its writer.

A writer writes its files into a folder and returns the one to read.
"""

import io
import json
import pickle
import sqlite3
import struct
import zipfile
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from fuzz.originals import COMMAND

from .bombs import zip_bomb
from .meshes import file, link
from .models import Writer, endless_file

DEEP = 100_000
LISTS, OBJECTS = "[" * DEEP + "]" * DEEP, '{"a":' * DEEP + "1" + "}" * DEEP
#: Nested less deeply than readers of JSON allow, but more than recursion over the values does.
LESS_DEEP = "[" * 900 + "]" * 900


@lru_cache(maxsize=1)
def good_solution() -> str:
    """Return a grasp with its squeeze, as JSON."""
    import clench

    hand, ball = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    commands = [clench.GraspCommand(pose, preshape="open") for pose in clench.approach_poses(hand, ball, 16, 0)]
    found = next(s for s in (clench.solve(hand, ball, c) for c in commands) if s.status == "grasp")
    named = replace(clench.complete(found, hand, ball), hand_model="patent15", object_model="ball")
    return json.dumps(named.to_dict())


def solution_with(change: Callable[[dict[str, Any]], None]) -> Writer:
    def write(folder: Path) -> Path:
        document = json.loads(good_solution())
        change(document)
        (folder / "solution.json").write_text(json.dumps(document))
        return folder / "solution.json"

    return write


def wide_scene(folder: Path) -> Path:
    """Write a glTF file whose scene is a list of millions of lists."""
    text = b'{"x":[' + b"[]," * 60_000_000 + b"1]}  "
    text += b" " * (-len(text) % 4)
    path = folder / "thing.glb"
    path.write_bytes(struct.pack("<5I", 0x46546C67, 2, 20 + len(text), len(text), 0x4E4F534A) + text)
    return path


def deep_command(text: str) -> Writer:
    return file("command.json", json.dumps({**COMMAND, "next_steps": "DEEP"}).replace('"DEEP"', text))


def deep_solution(folder: Path) -> Path:
    path = folder / "solution.json"
    path.write_text(json.dumps({**json.loads(good_solution()), "quality": {"x": "DEEP"}}).replace('"DEEP"', LESS_DEEP))
    return path


def numbers_of(**numbers: float) -> Callable[[dict[str, Any]], None]:
    def change(document: dict[str, Any]) -> None:
        for key, number in numbers.items():
            document[key] = dict.fromkeys(document["joint_angles"], number)

    return change


def npy(header: str, body: bytes = bytes(64), version: tuple[int, int] = (1, 0), length: int | None = None) -> bytes:
    text = header.encode() + b"\n"
    size = len(text) if length is None else length
    return b"\x93NUMPY" + bytes(version) + struct.pack("<H" if version == (1, 0) else "<I", size) + text + body


def header(descr: str = "'<f8'", shape: str = "(2, 7)") -> str:
    return f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}"


def saved(array: Any) -> bytes:
    out = io.BytesIO()
    np.save(out, array, allow_pickle=True)
    return out.getvalue()


def pickled(body: bytes) -> bytes:
    return npy(header("'|O'", "()"), body)


class Forged:
    """Pickle as a call of any function."""

    def __init__(self, function: Any, *arguments: Any, state: Any = None) -> None:
        self.call = (function, arguments) if state is None else (function, arguments, state)

    def __reduce__(self) -> Any:
        return self.call


def forged_dtype() -> bytes:
    """Return an array of objects whose type says that it is one of plain bytes: bytes of the file become addresses."""
    from numpy._core.numeric import _frombuffer

    dtype = Forged(np.dtype, "O8", False, True, state=(3, "|", None, None, None, -1, -1, 0))
    return pickled(pickle.dumps({"grasp_qpos": Forged(_frombuffer, b"\x41" * 8, dtype, (1,), "C")}, protocol=4))


def doubled_lists(depth: int = 40) -> bytes:
    value: Any = [0.0]
    for _ in range(depth):
        value = [value, value]
    return pickled(pickle.dumps({"grasp_qpos": value, "joint_names": value, "obj_pose": value}))


def many_nested() -> bytes:
    return pickled(b"\x80\x04" + b"]" * 200_000 + b"a" * 199_999 + b".")


GRASP: dict[str, Any] = {
    "grasp_qpos": np.array([0.0, 0, 0, 1, 0, 0, 0, 0.1]),
    "obj_pose": np.array([0.0, 0, 0, 1, 0, 0, 0]),
}


def grasp_with(**values: Any) -> Writer:
    return file("grasp.npy", saved(np.array({**GRASP, **values}, dtype=object)))


def laughing_yaml(kind: str) -> Writer:
    first, rest = ("{x: 1}", "<<: [{}]") if kind == "merge" else ("[x]", "[{}]")
    lines = [f"a0: &a0 {first}"]
    for i in range(1, 12):
        inside = rest.replace("{}", ", ".join([f"*a{i - 1}"] * 10))
        lines.append(f"a{i}: &a{i} {{{inside}}}" if kind == "merge" else f"a{i}: &a{i} {inside}")
    return file(
        "grasps.yaml", "format: isaac_grasp\nformat_version: 1.0\n" + "\n".join(lines) + "\ngrasps: {g: *a11}\n"
    )


YAML = "format: isaac_grasp\nformat_version: 1.0\ngrasps: "
ENTRY = "{g: {position: [0, 0, 0], orientation: {w: 1, xyz: [0, 0, 0]}, cspace_position: {j: @}}}\n"


def record(*statements: str, before: tuple[str, ...] = ()) -> Writer:
    """Return a writer of a record in which SQL was carried out."""

    def write(folder: Path) -> Path:
        import clench

        path = folder / "solves.sqlite"
        with clench.Record(path) as made:
            made.append(clench.GraspSolution.from_dict(json.loads(good_solution())))
        with sqlite3.connect(path, isolation_level=None) as c:
            for statement in statements:
                c.execute(statement)
            c.execute("PRAGMA journal_mode = DELETE")
        c.close()
        return path

    return write


ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
COLUMNS = "i AS id, '' AS time, '' AS hand, '' AS object, 'grasp' AS status, 0 AS seed, '' AS geometry_hash"
VIEW = f"CREATE VIEW solves AS {ENDLESS} SELECT {COLUMNS}, 0 AS touching_fingers, x'' AS document FROM n"


def command(**changed: Any) -> Writer:
    return file("command.json", json.dumps({"hand_pose": COMMAND["hand_pose"], **changed}))


def with_journal(folder: Path) -> Path:
    """Leave a journal beside a record that has SQLite read another file, and delete it."""
    name = str(folder / "victim").encode()
    magic = bytes.fromhex("d9d505f920a163d7")
    tail = struct.pack(">II", len(name), sum(name) & 0xFFFFFFFF) + magic
    path = record()(folder)
    (folder / "solves.sqlite-journal").write_bytes(
        bytes.fromhex("d9d505f920a163d7") + bytes(504) + bytes(4) + name + tail
    )
    return path


def malformed_pages(folder: Path) -> Path:
    path = record()(folder)
    data = bytearray(path.read_bytes())
    for place in range(4096, len(data), 512):
        data[place : place + 64] = b"\xff" * 64
    path.write_bytes(data)
    return path


def says_that_it_is_large(folder: Path) -> Path:
    path = record()(folder)
    data = bytearray(path.read_bytes())
    data[28:32] = b"\x7f\xff\xff\xff"
    path.write_bytes(data)
    return path


def archive(folder: Path) -> Path:
    path = folder / "poses.npy"
    path.write_bytes(zip_bomb("arr_0.npy"))
    return path


def stored(arrays: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as z:
        for name, data in arrays.items():
            z.writestr(name, data)
    return out.getvalue()


def offsets_of(number: float) -> Callable[[dict[str, Any]], None]:
    def change(document: dict[str, Any]) -> None:
        document["squeeze"]["feasible"] = True
        document["squeeze"]["offsets"] = dict.fromkeys(document["joint_angles"], number)

    return change


def trajectory(times: Any = (0.0, 1.0), angles: Any = (0.0, 0.1), **changed: Any) -> str:
    points = [{"time": t, "phase": "closing", "positions": [q]} for t, q in zip(times, angles, strict=True)]
    document = {"hand": "h", "object": "o", "joints": ["a"], "velocity_limits": [1.0], "points": points}
    return json.dumps({"schema": "clench.trajectory/1", **document, **changed})


def planned_with(change: Callable[[dict[str, Any]], None]) -> Writer:
    """Return a writer of a trajectory as it was planned, but for a change."""

    def write(folder: Path) -> Path:
        import clench

        hand, solution = clench.Hand.load("patent15"), clench.GraspSolution.from_dict(json.loads(good_solution()))
        document = clench.plan_trajectory(solution, hand).to_dict()
        change(document)
        (folder / "t.json").write_text(json.dumps(document))
        return folder / "t.json"

    return write


def bend(point: int, angle: float) -> Callable[[dict[str, Any]], None]:
    """Return a change of all angles of a way-point, so slow that no limit of velocity is passed."""

    def change(document: dict[str, Any]) -> None:
        for i, each in enumerate(document["points"]):
            each["time"] = 100.0 * i
        document["points"][point]["positions"] = [angle] * len(document["joints"])

    return change


TOML_KEYS = ".".join(["a"] * 20_000)

REFUSED: dict[str, tuple[str, Writer]] = {
    "glb wide": ("thing", wide_scene),
    "command endless": ("command", endless_file("command.json")),
    "command device": ("command", link("command.json", "/dev/zero")),
    "command deep": ("command", file("command.json", LISTS)),
    "command deep objects": ("command", file("command.json", OBJECTS)),
    "command deep inside": ("command", deep_command(LISTS)),
    "command less deep": ("command", deep_command(LESS_DEEP)),
    "command long number": ("command", file("command.json", json.dumps(COMMAND).replace("0.01", "1" * 1_000_000))),
    "command planes": ("solve", command(planes=10**9)),
    "command rounds": ("solve", command(rounds=10**9)),
    "command grids": ("solve", command(yaw_grid=[0.0] * 500, open_variants=[0.0] * 500)),
    "command steps": ("command", command(next_steps=[{}] * 100_000)),
    "command grid": ("command", command(yaw_grid=[0.0] * 100_000)),
    "command wide": ("command", file("command.json", "[" + "[]," * 5_000_000 + "1]")),
    "command many": (
        "command",
        file("command.json", json.dumps({"hand_pose": 1, **{f"k{i}": 1 for i in range(100_000)}})),
    ),
    "solution endless": ("solution", endless_file("solution.json")),
    "solution deep": ("solution", file("solution.json", LISTS)),
    "solution deep objects": ("solution", file("solution.json", OBJECTS)),
    "solution deep inside": ("solution", deep_solution),
    "solution wide": ("solution", file("solution.json", "[" + "[]," * 5_000_000 + "1]")),
    "solution of nan": ("solution", file("solution.json", '{"schema": "clench.solution/1", "x": NaN}')),
    "solution rounds": ("solution", solution_with(lambda d: d.update(rounds=-1))),
    "solution speed 0": ("solution", solution_with(numbers_of(speeds=0.0))),
    "solution speed below": ("solution", solution_with(numbers_of(speeds=-1.0))),
    "solution speed huge": ("solution", solution_with(numbers_of(speeds=1e300))),
    "solution speed tiny": ("solution", solution_with(numbers_of(speeds=5e-324))),
    "solution angle huge": ("solution", solution_with(numbers_of(joint_angles=1e308))),
    "solution open huge": ("solution", solution_with(numbers_of(open_angles=1e308))),
    "solution offsets huge": ("solution", solution_with(offsets_of(1e308))),
    "solution steps huge": ("solution", solution_with(lambda d: d.update(next_steps=[{"x": 1e308}] * 3))),
    "solution limits": ("solution", solution_with(lambda d: d.update(joint_limits={"a": [1.0, -1.0]}))),
    "solution cause": ("solution", solution_with(lambda d: [f.update(cause={}) for f in d["fingers"].values()])),
    "solution certificate": ("solution", solution_with(lambda d: d.update(certificate={"x": 1}))),
    "executed angle": ("execute", solution_with(numbers_of(joint_angles=1e5))),
    "executed steps": ("execute", solution_with(lambda d: d.update(next_steps=[{"index_mcp": 1e5}]))),
    "executed device": ("execute", solution_with(lambda d: d.update(hand_model="/dev/zero", object_model="/dev/zero"))),
    "executed elsewhere": ("execute", solution_with(lambda d: d.update(object_model="/etc/passwd"))),
    "executed object": ("execute", solution_with(lambda d: d.update(object_model="http://127.0.0.1:9/a.stl"))),
    "trajectory speed": ("trajectory", file("t.json", trajectory(speed=1e300))),
    "trajectory speed 0": ("trajectory", file("t.json", trajectory(speed=0.0))),
    "trajectory acceleration": ("trajectory", file("t.json", trajectory(acceleration=-1.0))),
    "trajectory limits": ("trajectory", file("t.json", trajectory(velocity_limits=[-1.0]))),
    "trajectory tiny limits": ("trajectory", file("t.json", trajectory(velocity_limits=[5e-324]))),
    "trajectory angles": ("trajectory", file("t.json", trajectory([0.0, 1.0], [0.0, 1e300]))),
    "trajectory late": ("trajectory", file("t.json", trajectory([0.0, 1e300]))),
    "trajectory early": ("trajectory", file("t.json", trajectory([-1e300, 1.0]))),
    "trajectory deep": ("trajectory", file("trajectory.json", LESS_DEEP)),
    "trajectory endless": ("trajectory", endless_file("trajectory.json")),
    "trajectory twice": ("trajectory", file("t.json", trajectory(joints=["a", "a"]))),
    "trajectory hurried": ("trajectory", file("t.json", trajectory([0.0, 1e-3], [0.0, 1.0]))),
    "trajectory nan": ("trajectory", file("t.json", trajectory([0.0, 1.0], [0.0, float("nan")]))),
    "trajectory many angles": ("trajectory", planned_with(lambda d: d["points"][1].update(positions=[0.0] * 10**6))),
    "trajectory many points": ("trajectory", planned_with(lambda d: d.update(points=d["points"][:1] * 50_000))),
    "moved limits": ("moved", planned_with(bend(2, 50.0))),
    "moved touch": ("moved", planned_with(bend(-1, 0.1))),
    "moved hand": ("moved", planned_with(lambda d: d.update(hand="other"))),
    "moved joints": ("moved", planned_with(lambda d: d["joints"].reverse())),
    "moved joint": ("moved", planned_with(lambda d: d["joints"].__setitem__(0, "toe\x1b[31m"))),
    "examples deep": ("examples", file("e.json", LISTS)),
    "examples device": ("examples", link("e.json", "/dev/zero")),
    "examples record": (
        "examples",
        file("e.json", json.dumps({"schema": "clench.examples/1", "record": "/dev/zero", "pairs": []})),
    ),
    "examples long record": (
        "examples",
        file("e.json", json.dumps({"schema": "clench.examples/1", "record": "a" * 5000, "pairs": []})),
    ),
    "executed long names": ("execute", solution_with(lambda d: d.update(hand_model="a/" * 5000 + "b.xml"))),
    "executed long object": ("execute", solution_with(lambda d: d.update(object_model="a" * 5000 + ".stl"))),
    "examples nan": ("examples", file("e.json", '{"schema": "clench.examples/1", "x": NaN}')),
    "calibration deep": ("calibration", file("weights.toml", "x = " + LISTS)),
    "calibration deep keys": ("calibration", file("weights.toml", f"{TOML_KEYS} = 1")),
    "calibration endless": ("calibration", endless_file("weights.toml")),
    "hand file deep": ("hand_file", file("x.toml", "palm = " + LISTS)),
    "hand file deep table": ("hand_file", file("x.toml", f"[{TOML_KEYS}]")),
    "hand file many keys": ("hand_file", file("x.toml", "".join(f"[a{'.a' * i}]\n" for i in range(1500)))),
    "hand file long number": ("hand_file", file("x.toml", "palm = " + "1" * 10_000_000)),
    "hand file device": ("hand_file", link("x.toml", "/dev/zero")),
    "joint map deep": ("joint_map", file("x.toml", "x = " + LISTS)),
    "joint map endless": ("joint_map", endless_file("x.toml")),
    "yaml laughs": ("grasps", laughing_yaml("list")),
    "yaml merges": ("grasps", laughing_yaml("merge")),
    "yaml wide": ("grasps", file("grasps.yaml", YAML + "[" + "[]," * 2_500_000 + "1]")),
    "yaml itself": ("grasps", file("grasps.yaml", YAML + "&a [*a]\n")),
    "yaml key itself": ("grasps", file("grasps.yaml", YAML + "{g: &a {position: *a}}\n")),
    "yaml deep": ("grasps", file("grasps.yaml", YAML + "[" * DEEP + "]" * DEEP)),
    "yaml deep blocks": ("grasps", file("grasps.yaml", YAML + "\n" + "- " * 20_000)),
    "yaml python": ("grasps", file("grasps.yaml", YAML + "!!python/object/apply:os.system [echo]\n")),
    "yaml long number": ("grasps", file("grasps.yaml", YAML + ENTRY.replace("@", "1" * 100_000))),
    "yaml sixties": ("grasps", file("grasps.yaml", YAML + ENTRY.replace("@", "1" + ":1" * 100_000))),
    "yaml date": ("grasps", file("grasps.yaml", YAML + ENTRY.replace("@", "2001-99-99"))),
    "yaml nan": ("grasps", file("grasps.yaml", YAML + ENTRY.replace("@", ".nan"))),
    "yaml text": ("grasps", file("grasps.yaml", YAML + ENTRY.replace("@", "true"))),
    "yaml endless": ("grasps", endless_file("grasps.yaml")),
    "yaml device": ("grasps", link("grasps.yaml", "/dev/zero")),
    "yaml escapes": ("grasps", file("grasps.yaml", YAML + '{"g\\e[31m": 1}\n')),
    "moveit deep": ("grasps", file("grasps.json", LISTS)),
    "moveit less deep": ("grasps", file("grasps.json", LESS_DEEP)),
    "npy forged dtype": ("grasps", lambda folder: file("g.npy", forged_dtype())(folder)),
    "npy calls": ("grasps", file("g.npy", pickled(pickle.dumps(Forged(print, "harm"))))),
    "npy builds": ("grasps", file("g.npy", pickled(b"cnumpy\ndtype\n}X\x01\x00\x00\x00aK\x01sb."))),
    "npy doubled": ("grasps", file("g.npy", doubled_lists())),
    "npy deep": ("grasps", file("g.npy", many_nested())),
    "npy memo": ("grasps", file("g.npy", pickled(b"\x80\x04}r\xff\xff\xff\x7f."))),
    "npy wide": ("grasps", file("g.npy", pickled(b"\x80\x04" + b"]" * 8_000_000 + b"."))),
    "npy long bytes": ("grasps", file("g.npy", pickled(b"\x80\x04\x8e" + b"\xff" * 7 + b"\x7fx."))),
    "npy long number": ("grasps", file("g.npy", pickled(b"I" + b"9" * 100_000 + b"\n."))),
    "npy huge shape": (
        "grasps",
        file("g.npy", pickled(pickle.dumps({"grasp_qpos": Forged(np.ndarray, (1 << 40,))}, protocol=4))),
    ),
    "npy itself": ("grasps", file("g.npy", pickled(b"\x80\x04]q\x00h\x00a."))),
    "npy cut": ("grasps", file("g.npy", pickled(pickle.dumps(GRASP)[:-30]))),
    "npy endless": ("grasps", endless_file("g.npy")),
    "npy text": ("grasps", grasp_with(grasp_qpos=np.array(["0"] * 7))),
    "npy numbers in text": ("grasps", grasp_with(grasp_qpos=["0"] * 8)),
    "npy bool": ("grasps", grasp_with(grasp_qpos=np.ones(8, dtype=bool))),
    "npy complex": ("grasps", grasp_with(grasp_qpos=np.ones(8, dtype=complex))),
    "npy nan": ("grasps", grasp_with(grasp_qpos=np.full(8, np.nan))),
    "npy empty": ("grasps", grasp_with(grasp_qpos=np.empty((0, 8)))),
    "npy no columns": ("grasps", grasp_with(grasp_qpos=np.empty((3, 0)))),
    "npy cube": ("grasps", grasp_with(grasp_qpos=np.zeros((2, 2, 8)))),
    "npy dates": ("grasps", grasp_with(grasp_qpos=np.zeros(8, dtype="M8[s]"))),
    "poses endless": ("poses", endless_file("poses.npy")),
    "poses archive": ("poses", archive),
    "poses huge": ("poses", file("poses.npy", npy(header(shape=f"({1 << 40}, 7)")))),
    "poses huger": ("poses", file("poses.npy", npy(header(shape=f"({1 << 62}, 7)")))),
    "poses below": ("poses", file("poses.npy", npy(header(shape="(-1, 7)")))),
    "poses of no bytes": ("poses", file("poses.npy", npy(header("'V0'", f"({1 << 40}, 7)")))),
    "poses no rows": ("poses", file("poses.npy", npy(header(shape=f"(0, {1 << 62})")))),
    "poses empty": ("poses", file("poses.npy", saved(np.empty(0)))),
    "poses empty rows": ("poses", file("poses.npy", saved(np.empty((0, 3))))),
    "poses empty matrices": ("poses", file("poses.npy", saved(np.empty((5, 0, 4))))),
    "poses scalar": ("poses", file("poses.npy", saved(np.array(1.0)))),
    "poses header": ("poses", file("poses.npy", npy("(" * 200_000, version=(2, 0)))),
    "poses short nested header": ("poses", file("poses.npy", npy("(" * 9000))),
    "poses header length": ("poses", file("poses.npy", npy(header(), version=(2, 0), length=2**32 - 1))),
    "poses objects": ("poses", file("poses.npy", saved(np.array([Forged(print, "harm")], dtype=object)))),
    "poses text": ("poses", file("poses.npy", saved(np.array([["1"] + ["0"] * 6])))),
    "poses bytes": ("poses", file("poses.npy", saved(np.array([[b"1"] + [b"0"] * 6])))),
    "poses bool": ("poses", file("poses.npy", saved(np.array([[True] + [False] * 6])))),
    "poses complex": ("poses", file("poses.npy", saved(np.array([[1.0 + 2j] + [0.0] * 6])))),
    "poses dates": ("poses", file("poses.npy", saved(np.zeros((1, 7), dtype="m8[s]")))),
    "poses device": ("poses", link("poses.npy", "/dev/zero")),
    "poses forged dtype": ("poses", file("poses.npy", npy(header("[('a', '|O')]", "(1,)")))),
    "record view": ("record", record("DROP TABLE solves", VIEW)),
    "record trigger": (
        "record",
        record("CREATE TRIGGER t BEFORE INSERT ON solves BEGIN SELECT RAISE(IGNORE); END"),
    ),
    "record index": ("record", record("CREATE INDEX i ON solves (length(zeroblob(1000)))")),
    "record generated": (
        "record",
        record(
            "ALTER TABLE solves ADD COLUMN more AS (zeroblob(1000))",
        ),
    ),
    "record virtual": (
        "record",
        record("DROP TABLE outcomes", "CREATE VIRTUAL TABLE outcomes USING fts5(solve, time, held)"),
    ),
    "record pages": ("record", malformed_pages),
    "record deep": ("record", record(f"UPDATE solves SET document = CAST('{LISTS}' AS BLOB)")),
    "record less deep": ("record", record(f"UPDATE solves SET document = CAST('{LESS_DEEP}' AS BLOB)")),
    "record large": ("record", record("UPDATE solves SET document = zeroblob(200000000)")),
    "record text": ("record", record("UPDATE solves SET hand = zeroblob(10), touching_fingers = 'x'")),
    "record journal": ("record", with_journal),
    "record device": ("record", link("solves.sqlite", "/dev/zero")),
}

#: What is read as it is, or not, but harms nothing.
HARMLESS: dict[str, tuple[str, Writer]] = {
    "executed edited": ("execute", solution_with(lambda d: (offsets_of(1e5)(d), numbers_of(speeds=1e5)(d)))),
    "executed steps": ("execute", solution_with(lambda d: d.update(next_steps=[{}] * 50))),
    "executed rounds": ("execute", solution_with(lambda d: d.update(rounds=10**9))),
    "record of many pages": ("record", says_that_it_is_large),
    "record with a table beside": ("record", record("CREATE TABLE notes (text)", "CREATE VIEW v AS SELECT 1")),
    "npy archive inside": ("grasps", file("g.npy", stored({"arr_0.npy": saved(np.zeros(3))}))),
}
