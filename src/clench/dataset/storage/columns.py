"""The columns of a dataset: one table that writing, reading, exporting and docs/dataset.md follow."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Final, NamedTuple

from clench.core.exceptions import ClenchError
from clench.core.extras import how_to_install

if TYPE_CHECKING:
    import pyarrow

SCHEMA: Final = "clench.grasps/1"


class Column(NamedTuple):
    """A column: its type, see `_arrow_type`, whether it may be null, and its description."""

    type: str
    nullable: bool
    text: str


#: All columns, in order. Types: text, whole, number, truth. A pose is [w, x, y, z, X, Y, Z]. Texts, numbers and points
#: are lists; a point is [x, y, z].
COLUMNS: Final = {
    "hand": Column("text", False, "name of the hand"),
    "hand_model": Column("text", False, "its model, as the job names it"),
    "hand_hash": Column("text", False, "SHA-256 of its kinematics and shapes"),
    "hand_license": Column("text", True, "licence file beside the model, and its first line; null without one"),
    "object": Column("text", False, "name of the object"),
    "object_model": Column("text", False, "its model, as the job names it"),
    "object_hash": Column("text", False, "SHA-256 of its geometry at this scale"),
    "object_license": Column("text", True, "licence file beside the model, and its first line; null without one"),
    "scale": Column("number", False, "what the lengths of the object's model were multiplied by [-]"),
    "object_collision_source": Column("text", False, "`raw`, or `engine`: the convex pieces of a job with `hold`"),
    "unit": Column("text", False, "key of the unit of work"),
    "seed": Column("whole", False, "seed of the unit"),
    "proposal": Column("whole", False, "number of the planner's proposal in the unit, from 0"),
    "clench_version": Column("text", False, "version that computed the row"),
    "ok": Column("truth", False, "the grasp is complete, and was held where that was tested"),
    "stage": Column("text", True, "where it failed: `squeeze`, `path` or `hold`; null for one that did not"),
    "reason": Column("text", True, "why it failed; null for one that did not"),
    "kind": Column("text", False, "`pinch`, `tripod`, `precision` or `power`"),
    "preshape": Column("text", False, "name of the preshape"),
    "preshape_joints": Column("texts", False, "joints that the preshape sets"),
    "preshape_angles": Column("numbers", False, "their angles [rad]"),
    "fingers": Column("texts", True, "fingers that close; null is all"),
    "T_world_palm": Column("pose", False, "pose of the palm link"),
    "T_object_palm": Column("pose", False, "the same in the object's frame"),
    "T_world_object": Column("pose", False, "pose of the object"),
    "pregrasp": Column("numbers", True, "angles of all joints at the pregrasp [rad]; null without a path"),
    "touch": Column("numbers", False, "angles of all joints at the touch [rad]"),
    "squeeze": Column("numbers", True, "what servos are told to squeeze [rad]; null without a squeeze or their gains"),
    "torque_joints": Column("texts", True, "degrees of freedom that the torques are of; null without a squeeze"),
    "torques": Column("numbers", True, "torques of the squeeze [Nm]; null without one"),
    "margin": Column("number", True, "disturbances are resisted up to this multiple [-]; null without a squeeze"),
    "contact_finger": Column("texts", False, "finger of every contact"),
    "contact_link": Column("texts", False, "link of every contact"),
    "contact_position": Column("points", False, "place in the object's frame [m]"),
    "contact_normal": Column("points", False, "unit normal out of the object, in its frame"),
    "contact_force": Column("points", True, "force on the object, in its frame [N]; null without a squeeze"),
    "epsilon": Column("number", True, "Ferrari–Canny ball at the lowest friction [N/N]; null without a squeeze"),
    "score": Column("number", True, "mean of epsilon at the lowest friction and at half of it; null as epsilon"),
    "confidence": Column("number", True, "measured share of grasps with such a score that held; null as epsilon"),
    "certified": Column("truth", False, "the certificate of the closing holds"),
    "penetration": Column("number", True, "largest depth over all links [m]; null when it was not measured"),
    "held": Column("truth", True, "held in simulation, in six directions; null when it was not tested"),
    "held_5mm_5deg": Column("truth", True, "the object moved by less than 5 mm and 5° meanwhile"),
    "hold_distance": Column("number", True, "how far its centre of mass moved at most [m]"),
    "hold_angle": Column("number", True, "how far it turned at most [rad]"),
    "hold_reason": Column("text", True, "what came of the test, in a sentence"),
}

#: Columns of text that few values fill: written as numbers of a dictionary.
TEXTS: Final = tuple(name for name, column in COLUMNS.items() if column.type in ("text", "texts"))


def need_pyarrow() -> None:
    """Refuse to go on without pyarrow.

    Raises:
        ClenchError: it is not installed.
    """
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        raise ClenchError(f"Datasets need pyarrow: {how_to_install('data')}.") from None


@cache
def arrow_schema() -> pyarrow.Schema:
    """Return the schema of the rows; metadata of a file come besides."""
    import pyarrow as pa

    return pa.schema([pa.field(name, _arrow_type(c.type), c.nullable) for name, c in COLUMNS.items()])


def _arrow_type(name: str) -> pyarrow.DataType:
    import pyarrow as pa

    number = pa.field("element", pa.float64(), nullable=False)
    text = pa.field("element", pa.string(), nullable=False)
    point = pa.field("element", pa.list_(number, 3), nullable=False)
    types = {
        "text": pa.string(),
        "whole": pa.int64(),
        "number": pa.float64(),
        "truth": pa.bool_(),
        "pose": pa.list_(number, 7),
        "texts": pa.list_(text),
        "numbers": pa.list_(number),
        "points": pa.list_(point),
    }
    return types[name]
