"""Trials of files from other programs: grasps, arrays, trajectories, pictures, models in parts, and records."""

import io
import json
import pickle
import sqlite3
import zlib
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import clench
from clench.core.files.array_files import read_array
from clench.core.pose_arrays import pose_rows
from clench.execution.hardware.joint_map import JointMap
from clench.models.hand.reading.png_checks import checked_png

from .mutation import Rng, pick, spoil_bytes, spoil_text, spoil_tree, to_json
from .originals import MJCF, link_stl
from .outcomes import Trial
from .trials import good

GRASPS = """format: isaac_grasp
format_version: 1.0
object_frame: ball
grasps:
  one: &one
    confidence: 1.0
    position: [0.0, 0.0, -0.05]
    orientation: {w: 1.0, xyz: [0.0, 0.0, 0.0]}
    cspace_position: {index_a: 0.1, index_b: 0.08, thumb_a: 0.2}
  two: {<<: *one, confidence: 0.5}
"""
JOINT_MAP = """[joints.index_a]
name = "finger_joint"
unit = "deg"
offset = 0.0
[joints.thumb_a]
name = "other_joint"
direction = -1
"""
_ORDERS = ("C", "F")
_TYPES = ("<f8", ">f8", "<f4", "<i8", "|b1", "<c16", "<U4", "|S4", "|V8", "<M8[s]", "<f2")


def pickled_grasps(rng: Rng, folder: Path) -> Trial:
    """Change bytes of a pickle, the types of its arrays, or what is in them."""
    path = folder / "grasps.npy"
    rows = np.tile([0.0, 0.0, -0.05, 1.0, 0.0, 0.0, 0.0, 0.1, 0.08, 0.2], (int(rng.integers(1, 4)), 1))
    values: dict[str, Any] = {"grasp_qpos": rows, "obj_pose": np.array([0.0, 0, 0, 1, 0, 0, 0]), "obj_scale": 1.0}
    key = pick(rng, list(values))
    if rng.random() < 0.5:
        changed = np.array(values[key]).astype(pick(rng, _TYPES))
        values[key] = np.array(changed, order=pick(rng, _ORDERS))
    elif rng.random() < 0.3:
        values[key] = [values[key]] * 3
    content = io.BytesIO()
    np.save(content, np.array(values, dtype=object), allow_pickle=True)
    data = content.getvalue()
    if rng.random() < 0.3:
        head = data[: data.index(b"\n") + 1]
        data = head + pickle.dumps(np.array(values, dtype=object), protocol=int(rng.integers(2, 6)))
    path.write_bytes(spoil_bytes(rng, data) if rng.random() < 0.7 else data)
    return Trial("pickled grasps", lambda: [g.joint_angles for g in clench.import_grasps(path)], ("grasps.npy",))


def grasps_in_yaml(rng: Rng, folder: Path) -> Trial:
    path = folder / "grasps.yaml"
    path.write_bytes(spoil_text(rng, GRASPS))
    return Trial("grasps in YAML", lambda: [g.joint_angles for g in clench.import_grasps(path)], ("grasps.yaml",))


def array_of_poses(rng: Rng, folder: Path) -> Trial:
    """Change bytes, types and shapes of an array of poses."""
    path = folder / "poses.npy"
    rows = np.tile([1.0, 0, 0, 0, 0, 0, 0.1], (3, 1)).astype(pick(rng, _TYPES)) if rng.random() < 0.5 else np.eye(4)
    content = io.BytesIO()
    np.save(content, rows if rng.random() < 0.8 else rows[: int(rng.integers(2))])
    data = content.getvalue()
    path.write_bytes(spoil_bytes(rng, data) if rng.random() < 0.7 else data)
    return Trial("array of poses", lambda: pose_rows(read_array(path), str(path)), ("poses.npy",))


def trajectory_file(rng: Rng, folder: Path) -> Trial:
    path = folder / "trajectory.json"
    path.write_bytes(to_json(spoil_tree(rng, _planned())).encode())
    return Trial("trajectory", lambda: clench.Trajectory.load(path).to_dict(), ("trajectory.json",))


@lru_cache(maxsize=1)
def _planned() -> dict[str, Any]:
    hand, _, solution, _ = good()
    return clench.plan_trajectory(solution, hand).to_dict()


def joint_map_file(rng: Rng, folder: Path) -> Trial:
    path = folder / "map.toml"
    path.write_bytes(spoil_text(rng, JOINT_MAP))
    return Trial("joint map", lambda: list((JointMap.load(path).joints or {}).values()), ("map.toml",))


def included_model(rng: Rng, folder: Path) -> Trial:
    """Spoil a model whose parts are in files of their own, and which names a picture."""
    inside = MJCF[MJCF.index("<asset>") : MJCF.index("<default>")]
    texture = '<texture name="t" type="2d" file="t.png"/><material name="m" texture="t"/></asset>'
    (folder / "link.stl").write_bytes(link_stl())
    (folder / "t.png").write_bytes(_png())
    part = f"<mujoco>{inside.replace('</asset>', texture)}</mujoco>"
    main = MJCF.replace(inside, '<include file="part.xml"/>')
    spoiled = rng.random() < 0.5
    (folder / "part.xml").write_bytes(spoil_text(rng, part) if spoiled else part.encode())
    (folder / "pincer.xml").write_bytes(main.encode() if spoiled else spoil_text(rng, main))
    named = ("pincer", "part.xml", "palm", "index", "thumb", "link", "joint", "tendons")
    return Trial("included model", lambda: clench.Hand.load(folder / "pincer.xml"), named)


def picture(rng: Rng, folder: Path) -> Trial:
    """Spoil a picture that a model names."""
    (folder / "link.stl").write_bytes(link_stl())
    (folder / "t.png").write_bytes(spoil_bytes(rng, _png()))
    asset = '<asset><texture name="t" type="2d" file="t.png"/><material name="m" texture="t"/>'
    (folder / "pincer.xml").write_text(MJCF.replace("<asset>", asset, 1))
    return Trial("picture", lambda: clench.Hand.load(folder / "pincer.xml"), ("t.png", "pincer"))


@lru_cache(maxsize=1)
def _png() -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(out, "PNG")
    data = checked_png(out.getvalue())
    assert zlib.crc32(data)
    return data


_CHANGES = (
    "CREATE TRIGGER t AFTER INSERT ON solves BEGIN DELETE FROM solves; END",
    "CREATE VIEW v AS SELECT * FROM solves",
    "CREATE INDEX i ON solves (time)",
    "ALTER TABLE solves ADD COLUMN more",
    "ALTER TABLE outcomes RENAME TO other",
    "DROP TABLE outcomes",
    "DROP TABLE solves",
    "UPDATE solves SET id = -5 WHERE id = 2",
    "UPDATE solves SET document = 'x'",
    "UPDATE solves SET document = CAST(document AS TEXT)",
    "UPDATE solves SET status = 7, time = NULL",
    "PRAGMA user_version = 0",
    "PRAGMA user_version = -3",
    "PRAGMA application_id = 0",
    "PRAGMA journal_mode = DELETE",
)


def record_schema(rng: Rng, folder: Path) -> Trial:
    """Change the tables of a record, and what is in them."""
    path = folder / "solves.sqlite"
    with clench.Record(path) as record:
        record.extend([good()[2]] * 2)
    connection = sqlite3.connect(path, isolation_level=None)
    for statement in rng.choice(_CHANGES, int(rng.integers(1, 3)), replace=False):
        try:
            connection.execute(str(statement))
        except sqlite3.Error:  # what one statement changed may not suit the next
            break
    connection.close()

    def run() -> Any:
        with clench.Record(path) as record:
            found = [len(record), len(record.find()), record.outcomes()]
            before = len(record)
            record.append(good()[2])
            assert len(record) == before + 1, "what was recorded is lost"
            return [*found, json.dumps(record.read(1).to_dict())[:10]]

    return Trial("record schema", run, ("solves.sqlite", "solve"))
