"""Read a dataset: batches, filters, formats; and files that are none are refused with a sentence."""

from __future__ import annotations

import json
import pickle
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa  # noqa: TID253
import pyarrow.parquet as pq  # noqa: TID253
import pytest

import clench
from clench.apps.cli.main import main
from clench.core.exceptions import ClenchError, CommandError, UnknownNameError
from clench.dataset.access.exporting import export
from clench.dataset.access.reading import GraspDataset
from clench.dataset.access.reading import open as open_dataset
from clench.dataset.jobs.job import DatasetJob
from clench.dataset.running.generating import generate
from clench.dataset.storage.columns import COLUMNS, arrow_schema
from clench.dataset.storage.merging import GROUP
from made_rows import JOINTS, make_result

ROWS = 2 * 2 * 2500


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "out"
    job = DatasetJob(hands=("robonaut2", "patent15"), objects=("mug", "ball"), count=2500, unit=1000)
    generate(job, folder, runner=lambda j, units: (make_result(j, unit) for unit in units))
    return folder


@pytest.fixture(scope="module")
def dataset(folder: Path) -> GraspDataset:
    return open_dataset(folder)


def test_a_dataset_is_found_by_its_folder_or_its_file(folder: Path, dataset: GraspDataset) -> None:
    assert len(dataset) == len(open_dataset(folder / "grasps.parquet")) == ROWS
    assert pq.ParquetFile(folder / "grasps.parquet").metadata.row_group(0).num_rows == GROUP
    assert dataset.job["count"] == 2500
    assert list(dataset.hands) == ["robonaut2", "patent15"]
    assert "10000 grasps of robonaut2, patent15" in repr(dataset)


def test_batches_have_all_rows_in_order(dataset: GraspDataset) -> None:
    sizes, units = [], []
    for batch in dataset.batches(999):
        assert batch.keys() == COLUMNS.keys()
        sizes.append(len(batch["ok"]))
        units += batch["unit"].tolist()
    assert sizes == [999] * 10 + [10]
    assert list(dict.fromkeys(units)) == [unit.key for unit in DatasetJob(**dataset.job).units()]


def test_arrays_have_stated_shapes_and_nulls(dataset: GraspDataset) -> None:
    batch = next(dataset.batches(100))
    rows = [dataset.row(number) for number in range(100)]
    assert batch["T_world_palm"].tolist() == [row["T_world_palm"] for row in rows]
    assert batch["touch"].shape == (100, len(JOINTS))
    assert batch["contact_position"].shape == (100, 4, 3)
    assert (batch["ok"].dtype, batch["held"].dtype, batch["seed"].dtype) == (np.bool_, np.int8, np.int64)
    for number, row in enumerate(rows):
        count = len(row["contact_position"])
        assert batch["contact_position"][number, :count].tolist() == row["contact_position"]
        assert np.isnan(batch["contact_position"][number, count:]).all()
        assert batch["held"][number] == (-1 if row["held"] is None else row["held"])
        assert np.isnan(batch["epsilon"][number]) == (row["epsilon"] is None)
        assert np.isnan(batch["pregrasp"][number]).all() == (row["pregrasp"] is None)
        assert batch["contact_link"][number] == row["contact_link"]
        assert batch["reason"][number] == row["reason"]


def test_filters_choose_rows(dataset: GraspDataset) -> None:
    epsilon = np.concatenate([batch["epsilon"] for batch in dataset.batches(5000, ["epsilon"])])
    mug = dataset.filter(hand_model="robonaut2", object_model=["mug", "cup"])
    assert len(mug) == 2500
    assert len(dataset.filter(epsilon=(0.5, None))) == np.sum(epsilon >= 0.5)
    assert len(dataset.filter(epsilon=(0.2, 0.5), ok=True)) == np.sum((epsilon >= 0.2) & (epsilon <= 0.5))
    assert len(dataset.filter(epsilon=None)) == len(dataset.filter(ok=False)) == np.isnan(epsilon).sum()
    assert len(dataset.filter(held=True)) + len(dataset.filter(held=False)) == len(dataset.filter(ok=True))
    once = mug.filter(ok=True)
    assert len(once) == len(dataset.filter(ok=True, hand_model="robonaut2", object_model="mug")) < 2500
    assert [once.row(k)["proposal"] for k in (0, 1, -1)] == [1, 2, 499]
    assert len(dataset.filter(seed=-1)) == 0
    assert list(dataset.filter(seed=-1).batches(5)) == []


@pytest.mark.parametrize(
    ("conditions", "said"),
    [
        ({"epsilonn": 1}, "Column 'epsilonn' is not in the dataset. Did you mean 'epsilon'?"),
        ({"touch": 1}, "filter: 'touch' is a column of lists"),
        ({"epsilon": "much"}, "filter: epsilon: expected a value of type double"),
        ({"kind": (1, 2)}, "filter: kind: expected a value of type string"),
    ],
)
def test_wrong_filters_get_a_sentence(dataset: GraspDataset, conditions: dict, said: str) -> None:
    with pytest.raises((CommandError, UnknownNameError)) as raised:
        dataset.filter(**conditions)
    assert said in str(raised.value)


def test_wrong_batches_and_rows_get_a_sentence(dataset: GraspDataset) -> None:
    with pytest.raises(CommandError, match="size: expected a whole number of at least 1"):
        next(dataset.batches(0))
    with pytest.raises(UnknownNameError, match="Column 'joints' is not in the dataset"):
        next(dataset.batches(5, ["joints"]))
    with pytest.raises(CommandError, match="row: expected a number below 10000, got 10000"):
        dataset.row(ROWS)


def test_tensors(dataset: GraspDataset) -> None:
    torch = pytest.importorskip("torch")
    batch = next(dataset.torch(10))
    assert batch["touch"].dtype == torch.float64
    assert batch["touch"].shape == (10, len(JOINTS))
    assert "kind" not in batch


def test_tensors_without_torch_get_a_sentence(dataset: GraspDataset, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ClenchError, match="need PyTorch: pip install torch"):
        next(dataset.torch(10))


def test_without_pyarrow_there_is_a_sentence(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    assert main(["generate", "--merge", str(folder)]) == 2
    assert "Datasets need pyarrow: pip install 'clench[data]' (in a checkout: uv sync" in capsys.readouterr().err


def test_a_dataset_goes_to_other_processes(dataset: GraspDataset) -> None:
    again = pickle.loads(pickle.dumps(dataset.filter(ok=True)))
    assert len(again) == len(dataset.filter(ok=True))
    assert again.row(5) == dataset.filter(ok=True).row(5)


def test_the_namespace_has_what_it_promises() -> None:
    assert clench.dataset.open is open_dataset
    with pytest.raises(AttributeError, match="no attribute 'load'; it has: DatasetJob"):
        _ = clench.dataset.load


def test_hdf5_has_every_value(dataset: GraspDataset, tmp_path: Path) -> None:
    import h5py

    (path,) = export(dataset, tmp_path / "all.h5", "hdf5")
    with h5py.File(path) as file:
        assert file.attrs["schema"] == "clench.grasps/1"
        group = file["hand_1"]
        assert (group.attrs["hand_model"], list(group.attrs["joints"])) == ("patent15", list(JOINTS))
        rows = dataset.filter(hand_model="patent15")
        for number in (0, 1, 4096, 4999):
            row = rows.row(number)
            assert group["touch"][number].tolist() == row["touch"]
            assert group["object_model"][number].decode() == row["object_model"]
            assert group["held"][number] == (-1 if row["held"] is None else row["held"])
            for name in ("contact_position", "contact_force", "torques", "contact_link"):
                low, high = group[f"{name}_first"][number : number + 2]
                found = group[name][low:high].tolist()
                assert [v.decode() if isinstance(v, bytes) else v for v in found] == (row[name] or [])
    assert not list(tmp_path.glob(".*"))


def test_the_command_exports_datasets(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(folder), "--out", "all.h5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == ["all.h5"]
    assert main(["export", str(folder), "--out", "x", "--format", "moveit_grasp"]) == 2
    assert "Format 'moveit_grasp' is not in datasets" in capsys.readouterr().err
    assert main(["export", str(folder), "--out", "x", "--hold"]) == 2
    assert "a dataset is written as it was computed" in capsys.readouterr().err
    assert main(["export", "solution.json", "--out", "x.h5"]) == 2
    assert "hdf5: is for datasets" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["all.h5"]


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda content: b"", "is no Parquet file that can be read"),
        (lambda content: b"PAR1" + bytes(100), "is no Parquet file that can be read"),
        (lambda content: content[:-50], "is no Parquet file that can be read"),
        (lambda content: content[:5000] + bytes(50_000) + content[55_000:], "rows cannot be read"),
    ],
)
def test_damaged_files_get_a_sentence(folder: Path, tmp_path: Path, damage, said: str) -> None:
    file = tmp_path / "x.parquet"
    file.write_bytes(damage((folder / "grasps.parquet").read_bytes()))
    with pytest.raises(ClenchError, match=said):
        list(open_dataset(file).batches(1000))


def test_files_of_others_get_a_sentence(folder: Path, tmp_path: Path) -> None:
    table = pq.read_table(folder / "grasps.parquet")
    file = tmp_path / "x.parquet"
    changed = {
        "schema: expected 'clench.grasps/1', got 'none'": table.replace_schema_metadata(None),
        "schema: expected 'clench.grasps/1', got 'clench.grasps/9'": table.replace_schema_metadata(
            table.schema.metadata | {b"clench.schema": b"clench.grasps/9"}
        ),
        "lacks the columns epsilon": table.drop_columns(["epsilon"]),
        "has columns of other types": table.cast(
            pa.schema(
                [f.with_type(pa.float32()) if f.name == "epsilon" else f for f in table.schema], table.schema.metadata
            )
        ),
    }
    for said, other in changed.items():
        pq.write_table(other, file)
        with pytest.raises(ClenchError, match=said):
            open_dataset(file)
    pq.write_table(pa.concat_tables([table] * 8), file, row_group_size=80_000)
    with pytest.raises(ClenchError, match="has a group of 80000 rows, which is more than clench writes"):
        open_dataset(file)
    with pytest.raises(ClenchError, match="no such file or folder"):
        open_dataset(tmp_path / "gone")


def test_rows_of_strangers_are_data(folder: Path, tmp_path: Path) -> None:
    row = pq.read_table(folder / "grasps.parquet").slice(1, 1).to_pylist()[0]
    hostile = {
        "an object that is not there": {"object_model": "/no/such.obj", "hand_model": "robonaut2"},
        "no joint of the hand": {"preshape_joints": ["\x1b[31m"], "preshape_angles": [0.0]},
        "angles that do not fit": {"preshape_joints": ["a", "b"], "preshape_angles": [0.0]},
        "no pose": {"T_world_palm": [float("nan")] * 7},
        "no quaternion": {"T_world_palm": [0.0] * 7},
        "no finger": {"fingers": ["../x"], "preshape_joints": [], "preshape_angles": []},
    }
    for what, values in hostile.items():
        rows = [row | {"object_model": "mug", "preshape_joints": [], "preshape_angles": []} | values]
        schema = pq.read_schema(folder / "grasps.parquet")
        file = tmp_path / "x.parquet"
        pq.write_table(pa.Table.from_pylist(rows, schema), file)
        with pytest.raises(ClenchError) as raised:
            open_dataset(file).solution(0)
        assert "\x1b" not in str(raised.value), what


def test_the_page_documents_every_column() -> None:
    import re

    text = (Path(__file__).parents[2] / "docs" / "dataset.md").read_text(encoding="utf-8")
    columns, job = text[text.index("## Columns") :].split("## The job")
    rows = re.findall(r"^\| `(\w+)` \| (\w+)( or null)? \| (.*) \|$", columns, re.MULTILINE)
    documented = {name: (kind, bool(null), said) for name, kind, null, said in rows}
    assert documented == {name: (c.type, c.nullable, c.text) for name, c in COLUMNS.items()}
    assert tuple(arrow_schema().names) == tuple(documented)
    assert re.findall(r"^\| `(\w+)` \|", job, re.MULTILINE) == list(DatasetJob.__struct_fields__)


def test_importing_clench_loads_none_of_it() -> None:
    import subprocess

    program = "import sys, clench; clench.dataset; print([m for m in ('pyarrow', 'h5py', 'ray') if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
    assert clench.__version__
