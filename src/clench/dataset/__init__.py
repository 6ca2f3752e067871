"""Datasets of grasps: generate them in parts on many cores, merge them, read them (docs/dataset.md).

Names are imported when first used: pyarrow, h5py and Ray belong to extras.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .access.exporting import export
    from .access.reading import GraspDataset, open
    from .jobs.job import DatasetJob
    from .jobs.shards import Shard
    from .ray_driver import generate_on_ray
    from .running.generating import generate
    from .storage.merging import merge

_HOMES = {
    "DatasetJob": "job",
    "GraspDataset": "reading",
    "Shard": "shards",
    "export": "exporting",
    "generate": "generating",
    "generate_on_ray": "ray_driver",
    "merge": "merging",
    "open": "reading",
}

__all__ = ["DatasetJob", "GraspDataset", "Shard", "export", "generate", "generate_on_ray", "merge", "open"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'clench.dataset' has no attribute {name!r}; it has: {', '.join(__all__)}")
    value = getattr(importlib.import_module(f"clench.dataset.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
