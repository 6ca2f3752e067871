"""Find the parts of a checkout of the project beside the package: the benchmarks."""

from __future__ import annotations

import importlib.util
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Final

import clench
from clench.core.exceptions import CommandError

_PACKAGE: Final = "benchmarks"
_SOURCE: Final = Path(clench.__file__).resolve().parent


def load_benchmarks() -> ModuleType:
    """Return the module with the benchmarks, from the folder `benchmarks` beside `src`.

    Raises:
        CommandError: the package is installed without a checkout.
    """
    file = _SOURCE.parents[1] / _PACKAGE / "__init__.py"
    if _SOURCE.parent.name != "src" or not file.is_file():
        raise CommandError(
            f"the benchmarks come with a checkout of clench, and this package is installed without one ({_SOURCE})."
        )
    loaded = sys.modules.get(_PACKAGE)
    if loaded is None or Path(loaded.__file__ or "").resolve() != file:
        _load(file)
    return import_module(f"{_PACKAGE}.bench_commands")


def _load(file: Path) -> None:
    """Import the package from its file, wherever Python looks for packages."""
    spec = importlib.util.spec_from_file_location(_PACKAGE, file, submodule_search_locations=[str(file.parent)])
    assert spec is not None
    assert spec.loader is not None
    package = importlib.util.module_from_spec(spec)
    sys.modules[_PACKAGE] = package
    spec.loader.exec_module(package)
