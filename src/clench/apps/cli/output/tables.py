"""Print tables for people on standard output, with every text shown verbatim."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from clench.core.showing.visible_text import visible

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def console_out() -> Console:
    """Return the printer for standard output."""
    from rich.console import Console

    return Console(highlight=False, soft_wrap=False)


def table_with(title: str, *columns: str) -> Table:
    """Return an empty table with heads of columns, which name the units of numbers."""
    from rich.table import Table

    table = Table(title=plain(title), title_justify="left", show_header=any(columns))
    for column in columns:
        table.add_column(plain(column), overflow="fold")
    return table


def plain(text: Any) -> str:
    """Return text in which square brackets and escape codes are just that: names come from files."""
    from rich.markup import escape

    return escape(visible(str(text)))
