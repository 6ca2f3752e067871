"""The pages about the method agree with the code: cited sections exist, tolerances and statuses are the code's."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CITED = "docs/method.md"
METHOD = (ROOT / CITED).read_text(encoding="utf-8")
CONVENTIONS = (ROOT / "docs" / "conventions.md").read_text(encoding="utf-8")
FILES = sorted(
    path
    for folder in ("src", "tests", "docs", "examples")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in {".py", ".md", ".toml"} and path != Path(__file__)
)
#: "docs/method.md section 3", "sections 4 to 6", "sections 1-2", "sections 5, 6", and then perhaps ", *Approach*".
CITATION = re.compile(r"docs/method\.md,? sections? (\d+(?:(?:, | and | to |-)\d+)*)(?:, \*([^*]+)\*)?")


def sections() -> dict[int, str]:
    """Return the text of every numbered section of the page."""
    parts = re.split(r"^## (\d+)\. ", METHOD, flags=re.MULTILINE)[1:]
    return {int(number): text for number, text in zip(parts[::2], parts[1::2], strict=True)}


def numbers(cited: str) -> list[int]:
    """Return the sections that a citation names, those between two numbers among them."""
    found: list[int] = []
    for word, number in re.findall(r"(, | and | to |-|^)(\d+)", cited):
        first = found[-1] + 1 if word in {" to ", "-"} else int(number)
        found += range(first, int(number) + 1)
    return found


def prose(path: Path) -> str:
    """Return a file's text with line breaks and the comment signs after them as single spaces."""
    return re.sub(r"\s*\n\s*(?:#:? ?)?", " ", path.read_text(encoding="utf-8"))


def citations() -> Iterator[tuple[str, str, str]]:
    """Give file, sections and part of every citation."""
    for path in FILES:
        for cited, part in CITATION.findall(prose(path)):
            yield str(path.relative_to(ROOT)), cited, part


@pytest.mark.parametrize(
    ("cited", "expected"),
    [("3", [3]), ("4 to 6", [4, 5, 6]), ("1-2", [1, 2]), ("5, 6", [5, 6]), ("1 and 3", [1, 3])],
)
def test_citations_are_understood(cited: str, expected: list[int]) -> None:
    assert numbers(cited) == expected


def test_every_cited_section_exists() -> None:
    known = sections()
    assert list(known) == list(range(1, 10))
    found = list(citations())
    assert len(found) > 80
    for file, cited, part in found:
        for number in numbers(cited):
            assert number in known, f"{file} cites section {number}"
        text = " ".join(known[number] for number in numbers(cited))
        assert part.lower() in text.lower(), f"{file} cites '{part}' in section {cited}"


def test_citations_name_the_page_where_it_is() -> None:
    wrong = [str(p.relative_to(ROOT)) for p in FILES if "METHOD" + ".md" in p.read_text(encoding="utf-8")]
    assert wrong == []


TOLERANCES = re.findall(r"^\| `([A-Z_]+)` \| (\S+) \|[^|]*\| `([a-z_.]+)` \|", CONVENTIONS, re.MULTILINE)


def test_the_table_of_tolerances_is_read() -> None:
    assert len(TOLERANCES) > 30


@pytest.mark.parametrize(("name", "value", "module"), TOLERANCES, ids=[f"{m}.{n}" for n, _, m in TOLERANCES])
def test_tolerances_have_the_documented_value(name: str, value: str, module: str) -> None:
    assert getattr(importlib.import_module(module), name) == float(value)


def test_every_tolerance_of_the_method_is_documented() -> None:
    from clench.core import tolerances

    names = {name for name in vars(tolerances) if name.isupper()}
    assert names <= {name for name, _, _ in TOLERANCES}


@pytest.mark.parametrize(
    "enum",
    [
        *("clench.solver.solution.SolutionStatus", "clench.solver.solution.FingerStatus"),
        *("clench.solver.solution.ContactKind", "clench.solver.certificate.CertificateCode"),
        *("clench.models.command.ClosingOrder", "clench.models.hand.hand.JointRole"),
        "clench.models.objects.grasp_object.BodyRole",
    ],
)
def test_every_status_is_documented(enum: str) -> None:
    module, name = enum.rsplit(".", 1)
    values = [member.value for member in getattr(importlib.import_module(module), name)]
    rows = re.findall(r"^\| [a-z ]+ \| ((?:`[\w-]+`(?:, )?)+) \|$", CONVENTIONS, re.MULTILINE)
    assert values in [re.findall(r"`([\w-]+)`", row) for row in rows]
