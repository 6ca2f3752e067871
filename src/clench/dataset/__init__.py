"""Datasets of grasps: generate them in parts on many cores, merge them, read them (docs/dataset.md).

Names are imported when first used: pyarrow, h5py and Ray belong to extras.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from clench.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from clench.dataset.access.exporting import export
    from clench.dataset.access.reading import GraspDataset, open
    from clench.dataset.jobs.job import DatasetJob
    from clench.dataset.jobs.shards import Shard
    from clench.dataset.ray_driver import generate_on_ray
    from clench.dataset.running.generating import generate
    from clench.dataset.storage.merging import merge

_HOMES = {
    "DatasetJob": "clench.dataset.jobs.job",
    "GraspDataset": "clench.dataset.access.reading",
    "Shard": "clench.dataset.jobs.shards",
    "export": "clench.dataset.access.exporting",
    "generate": "clench.dataset.running.generating",
    "generate_on_ray": "clench.dataset.ray_driver",
    "merge": "clench.dataset.storage.merging",
    "open": "clench.dataset.access.reading",
}

__all__ = ["DatasetJob", "GraspDataset", "Shard", "export", "generate", "generate_on_ray", "merge", "open"]


__getattr__, __dir__ = lazy_names(__name__, _HOMES)
