"""Pages of the site that are made when it is built: from README, examples, commands and docstrings."""

from __future__ import annotations

import inspect
import posixpath
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import griffe

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
#: Files of the repository that become pages, by their path in it.
COPIED = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "tests/README.md": "tests.md",
    "LICENSE": "license.md",
}
LINK = re.compile(r"(?<=\]\()(?!https?://|#)([^)#\s]+)((?:#[^)\s]*)?)(?=\))")

#: One text about several parameters, as in "hand, obj: what it was computed for."
SHARED = re.compile(r"^    (\w+(?:, \w+)+): (.*)$", re.MULTILINE)


def on_config(config: Any) -> None:
    """Put the pages that are made under their headings of the navigation."""
    found = {f"examples/{path.stem}.md": _title(path) for path in EXAMPLES}
    made = {
        "examples/index.md": ("Examples", [{title: page} for page, title in found.items()]),
        "api/index.md": ("Python API", [{name: f"api/{name}.md"} for name in _namespaces()]),
    }
    for section in config.nav:
        for name, entries in section.items():
            section[name] = [_with_pages(entry, made) for entry in entries]


def _with_pages(entry: Any, made: dict[str, tuple[str, list[dict[str, str]]]]) -> Any:
    """Return an entry of the navigation, with the pages below it if it is the first of pages that are made."""
    if not isinstance(entry, str) or entry not in made:
        return entry
    heading, pages = made[entry]
    return {heading: [entry, *pages]}


def on_files(files: Any, config: Any) -> None:
    """Add the pages that are made."""
    from mkdocs.structure.files import File

    for uri, content in _made_pages():
        files.append(File.generated(config, uri, content=content))


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn links between files of the repository into links between pages; add the options of the commands."""
    uri = page.file.src_uri
    if uri == "command-line.md":
        markdown += _command_options()
    sources = {made: source for source, made in COPIED.items()}
    return _relinked(markdown, sources.get(uri, f"docs/{uri}"), uri)


def _made_pages() -> Iterator[tuple[str, str]]:
    for source, uri in COPIED.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        yield uri, text if source.endswith(".md") else f"# Licence\n\n```text\n{text}\n```\n"
    rows = [f"| [{_title(path)}]({path.stem}.md) | {_purpose(path)} |" for path in EXAMPLES]
    how = "Every example is a short program. It runs as it stands: `uv run python examples/00_hello.py`."
    head = ["# Examples", "", how, "", "| example | what it shows |", "|---|---|"]
    yield "examples/index.md", "\n".join([*head, *rows, ""])
    for path in EXAMPLES:
        code = path.read_text(encoding="utf-8").split('"""', 2)[2].strip()
        page = [f"# {_title(path)}", _purpose(path), f"`examples/{path.name}`", f"```python\n{code}\n```", ""]
        yield f"examples/{path.stem}.md", "\n\n".join(page)
    yield from _api_pages()


def _title(example: Path) -> str:
    """Return the name of an example in words, as in "04 Own hand"."""
    number, _, words = example.stem.partition("_")
    return f"{number} {words.replace('_', ' ').capitalize()}"


def _purpose(example: Path) -> str:
    return " ".join(example.read_text(encoding="utf-8").split('"""')[1].split())


def _relinked(markdown: str, source: str, uri: str) -> str:
    """Return a page whose links lead to pages instead of files.

    Args:
        markdown: text of the page. source: its path in the repository. uri: its path in the site.
    """
    pages = {**COPIED, "examples": "examples/index.md"}
    pages |= {f"examples/{path.name}": f"examples/{path.stem}.md" for path in EXAMPLES}

    def to_page(match: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(posixpath.dirname(source), match[1]))
        made = pages.get(target, target.removeprefix("docs/") if target.startswith("docs/") else None)
        return match[0] if made is None else posixpath.relpath(made, posixpath.dirname(uri) or ".") + match[2]

    return LINK.sub(to_page, markdown)


# The command line.


def _command_options() -> str:
    from clench.apps.cli.command_table import COMMANDS

    return "".join(_command(name, command) for name, command in COMMANDS.items() if name != "bench")


def _command(name: str, command: Callable[..., int]) -> str:
    """Return the section of one command: what it does, and a table of its options."""
    said, told = inspect.cleandoc(command.__doc__ or ""), {}
    for part in griffe.Docstring(said).parse("google", warnings=False):
        if part.kind is griffe.DocstringSectionKind.parameters:
            told = {each.name: " ".join(each.description.split()) for each in part.value}
    rows = [_option(each, told.get(each.name, "")) for each in inspect.signature(command).parameters.values()]
    first = said.split("\n\nArgs:", 1)[0]
    return "\n".join(
        ["", f"### clench {name}", "", first, "", "| option | default | meaning |", "|---|---|---|", *rows, ""]
    )


def _option(parameter: inspect.Parameter, meaning: str) -> str:
    dashed = parameter.name.strip("_").replace("_", "-")
    option = dashed.upper() if parameter.kind is parameter.POSITIONAL_ONLY else f"--{dashed}"
    value = parameter.default
    default = "required" if value is parameter.empty else "" if value in (None, False, ()) else f"`{value}`"
    return f"| `{option}` | {default} | {meaning.replace('|', '&#124;')} |"


# The Python API.


class OneParameterALine(griffe.Extension):
    """Give each parameter a line of its own where a docstring puts several on one line."""

    def on_function_instance(self, *, func: griffe.Function, **_: Any) -> None:
        """Rewrite the `Args` of a function before they are parsed."""
        if func.docstring is None:
            return
        known = "|".join(parameter.name for parameter in func.parameters)
        begin = re.compile(rf"(?:(?<=[.;])\s+|^[ ]+)((?:(?:{known}), )*(?:{known})): ", re.MULTILINE)
        head, args, rest = func.docstring.value.partition("\nArgs:\n")
        found = re.search(r"\n\n(?=\S)", rest)
        told, after = (rest[: found.start()], rest[found.start() :]) if found else (rest, "")
        lines = begin.sub(r"\n    \1: ", told).lstrip("\n")
        lines = SHARED.sub(lambda found: "\n".join(f"    {name}: {found[2]}" for name in found[1].split(", ")), lines)
        func.docstring.value = head + args + lines + after


def _namespaces() -> list[str]:
    """Return the packages that promise public names, the root first."""
    root = ROOT / "src" / "clench"
    promised = [path.parent for path in (root / "__init__.py", *sorted(root.glob("*/__init__.py")))]
    promised += sorted(path for path in root.glob("*.py") if path.name != "__init__.py")
    return [
        "clench" if path == root else f"clench.{path.stem}"
        for path in promised
        if "\n__all__" in (path / "__init__.py" if path.is_dir() else path).read_text(encoding="utf-8")
    ]


def _api_pages() -> Iterator[tuple[str, str]]:
    package = griffe.load("clench", search_paths=[ROOT / "src"], resolve_aliases=True)
    index = ["# Python API", "", "Everything below is public. Other names may change without notice.", ""]
    for namespace in _namespaces():
        module = package if namespace == "clench" else package[namespace.removeprefix("clench.")]
        names = [name for name in (module.exports or []) if not name.startswith("__")]
        page = [f"# {namespace}", "", _first_line(module), ""]
        index += [f"## [{namespace}]({namespace}.md)", "", "| name | what it is for |", "|---|---|"]
        for name in sorted(names, key=lambda name: (not module[name].is_function, name.lower())):
            page += [f"::: {namespace}.{name}", ""]
            index.append(f"| [`{name}`]({namespace}.md#{namespace}.{name}) | {_first_line(module[name])} |")
        index.append("")
        yield f"api/{namespace}.md", "\n".join(page)
    yield "api/index.md", "\n".join(index)


def _first_line(described: Any) -> str:
    said = described.docstring.value.split("\n\n")[0] if described.docstring else ""
    return " ".join(said.split()).replace("|", "&#124;")
