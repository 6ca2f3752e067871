"""Tables, sentences and text from files on a console: what every printed answer is made of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from clench.base.visible_text import visible

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def console() -> Console:
    """Return the console of standard output."""
    from rich.console import Console

    return Console(highlight=False, soft_wrap=False)


def table(title: str, *columns: str) -> Table:
    """Return an empty table; without any heading the columns have none."""
    from rich.table import Table

    made = Table(title=plain(title), title_justify="left", show_header=any(columns))
    for column in columns:
        made.add_column(plain(column), overflow="fold")
    return made


def sentences(out: Console, label: str, texts: Sequence[str]) -> None:
    """Print sentences, each after a label."""
    for text in texts:
        out.print(f"[yellow]{label}:[/yellow] {plain(text)}")


def plain(text: Any) -> str:
    """Return text in which square brackets and escape codes are just that: names come from files."""
    from rich.markup import escape

    return escape(visible(str(text)))
