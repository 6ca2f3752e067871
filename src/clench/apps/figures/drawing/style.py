"""Colours that colour-blind readers can tell apart, and how a figure is made and saved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from clench.core.exceptions import FileError
from clench.core.files.json_files import check_writable
from clench.core.showing.visible_text import visible
from clench.models.appearance import JOINT_COLORS as JOINT_COLORS
from clench.models.appearance import joint_color as joint_color
from clench.models.appearance import mixed as mixed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI: Final = 100
#: Endings of the files that a figure can be written to.
ENDINGS: Final = (".png", ".pdf", ".svg", ".eps", ".ps", ".jpg", ".jpeg", ".tif", ".tiff", ".webp")
INK: Final = "#222222"
FAINT: Final = "#8a8a8a"
PAPER: Final = "#ffffff"
OBJECT_FILL: Final = "#efe6cf"
OBJECT_EDGE: Final = "#7a6a3a"
OBSTACLE_FILL: Final = "#e3e3e3"
OBSTACLE_EDGE: Final = "#6f6f6f"
PALM_FILL: Final = "#d9d9d9"
CONTACT: Final = "#d55e00"
CHOSEN: Final = "#0b7a53"


def new_figure(width: int, height: int) -> Figure:
    """Return an empty figure of a size in pixels, drawn without a screen and without any global state."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor=PAPER)
    FigureCanvasAgg(figure)
    return figure


def check_figure(path: Path) -> None:
    """Refuse a file to which no figure can be written, before anything is drawn.

    Raises:
        FileError: the file cannot be written, or its ending is no figure's.
    """
    check_writable(path)
    format_of_figure(path)


def format_of_figure(path: Path) -> str:
    """Return the format of a figure's file by its ending, PNG without one.

    Raises:
        FileError: no figure can be written with this ending.
    """
    ending = path.suffix.lower()
    if ending and ending not in ENDINGS:
        raise FileError(path, f"no figure has the ending '{path.suffix}'; expected {', '.join(ENDINGS)}.")
    return ending[1:] or "png"


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a figure in the format of the file's ending, PNG without one, and return its path.

    Raises:
        FileError: the file cannot be written, or no figure has its ending.
    """
    format = format_of_figure(path)
    options: dict[str, Any] = {"pil_kwargs": {"compress_level": 1}} if format == "png" else {}
    try:
        figure.savefig(path, dpi=DPI, format=format, **options)
    except OSError as error:
        raise FileError(path, f"cannot be written ({error.strerror or error}).") from None
    return path


def write(target: Any, x: float, y: float, text: str, **options: Any) -> Any:
    """Put text into a figure or axes; names with `$` stay as they are, and codes in them are written out."""
    label = target.text(x, y, "\n".join(map(visible, text.split("\n"))), **{"color": INK, "fontsize": 10, **options})
    label.set_parse_math(False)
    return label


def halo() -> list[Any]:
    """Return the effect that keeps text readable on top of lines."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=3.0, foreground=PAPER)]


def number_label(target: Any, place: tuple[float, float], numbers: list[int]) -> None:
    """Put the numbers of contacts into a rounded box."""
    label = write(target, *place, ", ".join(map(str, numbers)), color=PAPER, zorder=11, clip_on=True)
    label.set(ha="center", va="center", fontweight="bold")
    label.set_bbox({"boxstyle": "round,pad=0.25,rounding_size=0.7", "facecolor": CONTACT, "edgecolor": PAPER})
