"""The README of the package has no relative link: a package index could not follow one."""

from __future__ import annotations

import importlib.util
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
RELATIVE = re.compile(r"\]\((?!https://|#)[^)]*\)")


@pytest.fixture
def packaged(monkeypatch: pytest.MonkeyPatch) -> Callable[[str, str, str], str]:
    """Return `packaged` of hatch_build.py, loaded without the build backend."""
    backend = ModuleType("hatchling.metadata.plugin.interface")
    backend.MetadataHookInterface = object
    monkeypatch.setitem(sys.modules, "hatchling", ModuleType("hatchling"))
    monkeypatch.setitem(sys.modules, "hatchling.metadata.plugin.interface", backend)
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.packaged


def test_links_become_text_while_there_is_no_address(packaged: Callable[[str, str, str], str]) -> None:
    text = packaged(README, "", "")
    assert RELATIVE.findall(README)
    assert RELATIVE.findall(text) == []
    assert "![" not in text
    assert "How it works explains the steps." in " ".join(text.split())


def test_links_and_pictures_become_absolute(packaged: Callable[[str, str, str], str]) -> None:
    text = packaged(README, "https://example.org/blob/v1/", "https://example.org/raw/v1/")
    assert RELATIVE.findall(text) == []
    assert "](https://example.org/raw/v1/docs/images/index_plane.png)" in text
    assert "[Apache-2.0](https://example.org/blob/v1/LICENSE)" in text
    assert text.count("](https://") == README.count("](") - README.count("](#")
