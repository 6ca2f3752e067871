"""Write the card of a dataset: content, job, statistics and pictures, in DATASET.md."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench import __version__
from clench.core.exceptions import FileError
from clench.core.files.json_files import write_atomically
from clench.core.pose import FloatArray
from clench.dataset.running.unit_run import UnitRecord

from .columns import COLUMNS, SCHEMA
from .folder import MANIFEST_FILE, ROWS_FILE, DatasetFolder, whole_file

if TYPE_CHECKING:
    from .merging import Merged

CARD_FILE: Final = "DATASET.md"
PICTURES: Final = "pictures"
#: Hands or objects that a picture shows at most.
_SHOWN: Final = 30
_READ: Final = (
    "hand_model",
    "object_model",
    "ok",
    "stage",
    "kind",
    "epsilon",
    "hand_license",
    "object_license",
    "held",
)


@dataclass
class Counted:
    """Count the rows of a dataset.

    Args:
        pairs: by hand, object and `ok`. kind, stage, held: by the values of these columns.
        licenses: of every model. epsilon: of the rows that are `ok`.
    """

    pairs: Counter[tuple[str, str, bool]] = field(default_factory=Counter)
    kind: Counter[str] = field(default_factory=Counter)
    stage: Counter[str | None] = field(default_factory=Counter)
    held: Counter[bool | None] = field(default_factory=Counter)
    licenses: dict[str, str | None] = field(default_factory=dict)
    epsilon: FloatArray = field(default_factory=lambda: np.empty(0))


def write_card(folder: DatasetFolder, records: Sequence[UnitRecord], merged: Merged) -> None:
    """Write DATASET.md and its pictures.

    Args:
        folder: of the dataset. records: of all units. merged: the merged rows.

    Raises:
        FileError: a file cannot be written.
    """
    rows = _count(merged.file)
    pictures = folder.path / PICTURES
    try:
        pictures.mkdir(exist_ok=True)
    except OSError as error:
        raise FileError(pictures, f"cannot be made a folder ({error.strerror or error}).") from None
    _draw_counts(pictures / "counts.png", rows.pairs)
    _draw_epsilon(pictures / "epsilon.png", rows.epsilon)
    _draw_rejections(pictures / "rejections.png", records)
    write_atomically(folder.path / CARD_FILE, _text(folder, records, merged, rows).encode())


def _count(file: Path) -> Counted:
    """Count the rows, some thousand at a time."""
    import pyarrow.parquet as pq

    found, epsilon = Counted(), list[Any]()
    for batch in pq.ParquetFile(file).iter_batches(columns=list(_READ)):
        values = batch.to_pydict()
        found.pairs.update(zip(values["hand_model"], values["object_model"], values["ok"], strict=True))
        for name in ("kind", "stage", "held"):
            getattr(found, name).update(values[name])
        for kind in ("hand", "object"):
            found.licenses.update(zip(values[f"{kind}_model"], values[f"{kind}_license"], strict=True))
        good = zip(values["epsilon"], values["ok"], strict=True)
        epsilon.append(np.array([value for value, ok in good if ok and value is not None], dtype=np.float64))
    found.epsilon = np.concatenate(epsilon) if epsilon else found.epsilon
    return found


def _text(folder: DatasetFolder, records: Sequence[UnitRecord], merged: Merged, rows: Counted) -> str:
    job = folder.job
    failed = [record for record in records if record.status == "failed"]
    rejected: Counter[str] = sum((Counter(r.rejected) for r in records), Counter())
    closed = sum(record.closed for record in records)
    tested = rows.held[True] + rows.held[False]
    lines = [
        "# Dataset of grasps",
        "",
        f"{merged.ok} grasps that are complete, and {merged.rows - merged.ok} that failed, of {len(job.hands)} hands "
        f"and {len(job.objects)} objects. clench {__version__} computed them. Each grasp is a row of `{ROWS_FILE}`, "
        f"schema `{SCHEMA}`. `clench.dataset.open` reads it.",
        "",
        *_table(("what", "number"), _numbers(records, merged, closed)),
        *([f"Held in simulation: {rows.held[True]} of {tested} grasps.", ""] if tested else []),
        "![Grasps by hand and by object](pictures/counts.png)",
        "",
        "![Epsilon](pictures/epsilon.png)",
        "",
        "![What became of the proposals](pictures/rejections.png)",
        "",
        "## Grasps by hand and object",
        "",
        *_table(("hand", "object", "complete", "failed"), _pairs(rows.pairs)),
        "## Kinds, failures and rejections",
        "",
        *_table(("kind", "grasps"), rows.kind.most_common()),
        *_table(("failed at", "grasps"), [each for each in rows.stage.most_common() if each[0]]),
        *_table(("rejected for", "proposals"), rejected.most_common()),
        "## Sources",
        "",
        *_table(("model", "licence beside it"), [(m, text or "none found") for m, text in rows.licenses.items()]),
        "## Units that failed",
        "",
        *(_table(("hand", "object", "reason"), [(r.hand, r.object, r.reason) for r in failed]) or ["None.", ""]),
        "## Made with",
        "",
        f"Job `{job.hash}`; `{MANIFEST_FILE}` has all units. SHA-256 of `{ROWS_FILE}`: `{merged.sha256}`.",
        "",
        *_table(("key", "value"), [(key, f"`{value}`") for key, value in job.document().items()]),
        "## Columns",
        "",
        *_table(("column", "type", "what it says"), [(f"`{n}`", c.type, c.text) for n, c in COLUMNS.items()]),
    ]
    return "\n".join(lines).rstrip() + "\n"


def _numbers(records: Sequence[UnitRecord], merged: Merged, closed: int) -> list[tuple[str, Any]]:
    share = sum(record.force_closed for record in records) / closed if closed else 0.0
    return [
        ("rows", merged.rows),
        ("complete grasps (`ok`)", merged.ok),
        ("units", merged.units),
        ("units that failed", merged.failed),
        ("proposals", sum(record.proposed for record in records)),
        ("closed proposals", closed),
        ("of these with force closure by the bound", f"{100 * share:.1f} %"),
        ("bytes per row", round(merged.bytes / merged.rows) if merged.rows else 0),
    ]


def _pairs(counts: Counter[tuple[str, str, bool]]) -> list[tuple[Any, ...]]:
    pairs = dict.fromkeys((hand, obj) for hand, obj, _ in counts)
    return [(*pair, counts[(*pair, True)], counts[(*pair, False)]) for pair in pairs]


def _table(heading: Sequence[str], rows: Sequence[Sequence[Any]]) -> list[str]:
    """Return the lines of a Markdown table with an empty line at the end, or nothing without rows."""
    if not rows:
        return []
    cells = [" | ".join(str(cell).replace("|", "\\|").replace("\n", " ") for cell in row) for row in rows]
    return [f"| {' | '.join(heading)} |", "|" + "---|" * len(heading), *(f"| {row} |" for row in cells), ""]


def _draw_counts(file: Path, pairs: Counter[tuple[str, str, bool]]) -> None:
    figure, axes = _figure(2)
    for which, (ax, kind) in enumerate(zip(axes, ("hand", "object"), strict=True)):
        counts: dict[bool, Counter[str]] = {True: Counter(), False: Counter()}
        for (hand, obj, ok), number in pairs.items():
            counts[ok][(hand, obj)[which]] += number
        names = [model for model, _ in (counts[True] + counts[False]).most_common(_SHOWN)][::-1]
        good, failed = ([counts[ok][name] for name in names] for ok in (True, False))
        ax.barh(range(len(names)), good, color="tab:blue", label="complete")
        ax.barh(range(len(names)), failed, left=good, color="tab:orange", label="failed")
        ax.set_yticks(range(len(names)), [_short(name) for name in names])
        ax.set_xlabel(f"grasps by {kind}")
    axes[0].legend()
    _save(figure, file)


def _draw_epsilon(file: Path, epsilon: FloatArray) -> None:
    figure, (ax,) = _figure(1)
    ax.hist(epsilon, bins=40, color="tab:blue")
    ax.set_xlabel("epsilon [N/N] of complete grasps")
    ax.set_ylabel("grasps")
    _save(figure, file)


def _draw_rejections(file: Path, records: Sequence[UnitRecord]) -> None:
    figure, (ax,) = _figure(1)
    counts: Counter[str] = sum((Counter(r.rejected) for r in records), Counter())
    counts["complete or held"] = sum(record.ok for record in records)
    shown = counts.most_common()[::-1]
    ax.barh(range(len(shown)), [number for _, number in shown], color="tab:gray")
    ax.set_yticks(range(len(shown)), [reason for reason, _ in shown])
    ax.set_xlabel("proposals")
    _save(figure, file)


def _figure(columns: int) -> tuple[Any, list[Any]]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0 * columns, 4.0), layout="constrained")
    return figure, [figure.add_subplot(1, columns, k + 1) for k in range(columns)]


def _save(figure: Any, file: Path) -> None:
    with whole_file(file) as temporary:
        figure.savefig(temporary, format="png", dpi=100, metadata={"Software": None})


def _short(model: str) -> str:
    """Return the end of a model's path."""
    path = Path(model)
    text = f"{path.parent.name}/{path.stem}" if path.suffix and path.parent.name else model
    return text if len(text) <= 30 else f"…{text[-29:]}"
