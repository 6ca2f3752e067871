"""`clench bench scaling`: refined meshes are the same surface, and wrong answers are not timed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import clench
from benchmarks.bench_commands import main
from benchmarks.speed import scaling
from benchmarks.speed.refined import base_mesh, parted, refinements
from benchmarks.speed.scaling import Axis
from benchmarks.speed.solve_memory import solve_memory
from clench.core.exceptions import CommandError
from clench.models.mesh import TriangleMesh

SMALL = ["scaling", "--poses", "1", "--passes", "1", "--triangles", "16000", "--batch", "4", "--stream", "3"]


def area_and_volume(mesh: TriangleMesh) -> tuple[float, float]:
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    return float(0.5 * np.linalg.norm(normals, axis=1).sum()), float((a * normals).sum() / 6.0)


def test_parting_triangles_keeps_the_surface() -> None:
    mesh = base_mesh(clench.GraspObject.load("mug"), 1000)
    finer = parted(mesh)
    assert len(finer.triangles) == 4 * len(mesh.triangles)
    assert area_and_volume(finer) == pytest.approx(area_and_volume(mesh), rel=1e-12)
    edges = np.sort(finer.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # as closed as before


@pytest.mark.parametrize(
    ("model", "low", "high"),
    [("sphere:r=0.03", 500, 1200), ("ellipsoid:a=0.03,b=0.035,c=0.05", 500, 1200), ("box:x=1,y=1,z=1", 12, 12)],
)
def test_round_shapes_have_about_as_many_triangles_as_wanted(model: str, low: int, high: int) -> None:
    mesh = base_mesh(clench.GraspObject.load(model), 1000)
    assert low <= len(mesh.triangles) <= high
    sizes = [len(finer.triangles) for finer in refinements(mesh, 4 * len(mesh.triangles))]
    assert sizes == [len(mesh.triangles), 4 * len(mesh.triangles)]


def test_the_exponent_is_fitted() -> None:
    axis = Axis("triangles")
    for n in (10, 20, 70):
        axis.add(n, {"whole": 3.0 * n**0.5})
    assert axis.exponent("whole") == pytest.approx(0.5)


def test_it_prints_times_memory_and_pictures(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(scaling, "PLANES", (1, 3))
    picture, table = tmp_path / "scaling.png", tmp_path / "scaling.md"
    assert main([*SMALL, "--plot", str(picture), "--table", str(table), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["errors"] == []
    assert document["memory_triangles"] > 10000
    assert document["memory_peak_mb"] >= document["memory_held_mb"] > 50.0
    for key in ("triangles_exponent_whole", "planes_3_whole_ms", "fingers_5_fingers_ms", "batch_4_certified_ms"):
        assert key in document
    assert document["stream_poses"] == 3
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert table.read_text(encoding="utf-8").count("*exponent*") == 5


def test_the_memory_of_a_mesh_grows_with_its_triangles() -> None:
    coarse = base_mesh(clench.GraspObject.load("mug"), 1000)
    *_, fine = refinements(coarse, 300_000)
    few, many = (solve_memory("robonaut2", mesh) for mesh in (coarse, fine))
    more = (many["peak_mb"] - many["before_mb"]) - (few["peak_mb"] - few["before_mb"])
    # A tree takes 188 bytes per triangle, the mesh 36; loading holds copies of the mesh.
    assert more > 200e-6 * (len(fine.triangles) - len(coarse.triangles))


def test_wrong_answers_are_not_timed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(scaling, "PLANES", (1,))
    real, calls = scaling._angles, iter(range(10**6))
    monkeypatch.setattr(scaling, "_angles", lambda solution: real(solution) + 1e-5 * next(calls))
    assert main(SMALL) == 1
    printed = capsys.readouterr()
    assert "triangles, pose 0: an angle is off by" in printed.err
    assert "_ms" not in printed.out


def test_counts_of_nothing_are_refused() -> None:
    with pytest.raises(CommandError, match="--stream: expected at least 1"):
        main(["scaling", "--stream", "0"])
