"""Sentences about missing extras name extras that exist."""

import re
import tomllib
from pathlib import Path

from clench.core.extras import how_to_install

ROOT = Path(__file__).parents[2]


def test_every_named_extra_exists():
    named = set()
    for file in sorted((ROOT / "src").rglob("*.py")):
        named |= set(re.findall(r"how_to_install\([\"'](\w+)[\"']\)", file.read_text(encoding="utf-8")))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert len(named) > 5
    assert named <= set(project["optional-dependencies"])


def test_both_ways_are_named():
    assert how_to_install("viewer") == (
        "pip install 'clench[viewer]' (in a checkout: uv sync --no-dev --inexact --extra viewer)"
    )
