"""Print tables for people on standard output, with every text shown verbatim."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from clench.core.showing.visible_text import visible

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Column, Table


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


def print_table(console: Console, table: Table) -> None:
    """Print a table that breaks lines between words, so that names stay whole.

    A table that is too wide loses its frame first. If even the longest words do not fit side by side, words are broken.
    """
    from rich.box import SIMPLE_HEAD

    count = len(table.columns)
    if not _fit(table, console.width - (3 * count + 1)):
        table.box, table.show_edge, table.pad_edge, table.padding = SIMPLE_HEAD, False, False, (0, 1, 0, 0)
        _fit(table, console.width - 2 * (count - 1))
    console.print(table)


def _fit(table: Table, width: int) -> bool:
    """Set the widths of columns if their longest words fit into a width [characters]; return whether they do."""
    sizes = [_sizes(column) for column in table.columns]
    widths = [word for word, _, _ in sizes]
    left = width - sum(widths)
    if left < 0:
        return False
    # Short cells are whole before long ones, and cells before heads.
    for most in ([cells for _, cells, _ in sizes], [whole for _, _, whole in sizes]):
        for i in sorted(range(len(widths)), key=lambda i: most[i] - widths[i]):
            more = min(max(most[i] - widths[i], 0), left)
            widths[i] += more
            left -= more
    for column, size in zip(table.columns, widths, strict=True):
        column.width = size
    return True


def _sizes(column: Column) -> tuple[int, int, int]:
    """Return the width of the longest word of a column, of its longest cell, and of its longest cell or head."""
    from rich.cells import cell_len
    from rich.text import Text

    head, *texts = [Text.from_markup(str(cell)).plain for cell in (column.header, *column.cells)]
    word = max((cell_len(word) for text in (head, *texts) for word in text.split()), default=0)
    cells = max(map(cell_len, texts), default=0)
    return word, cells, max(cells, cell_len(head))


def plain(text: Any) -> str:
    """Return text in which square brackets and escape codes are just that: names come from files."""
    from rich.markup import escape

    return escape(visible(str(text)))
