"""How much memory a solve takes in a process of its own: this file, run with HAND and MESH.npz."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import numpy as np

import clench
from clench.models.mesh import TriangleMesh

_MB = 1e6


def solve_memory(hand_model: str, mesh: TriangleMesh) -> dict[str, float]:
    """Load a hand and a mesh in a fresh process, solve once there; return memory [MB], empty where it is not told.

    Returns:
        `before_mb`: before the mesh was there, with everything else loaded and compiled; `peak_mb`: largest since
        then; `held_mb`: at the end.

    Raises:
        subprocess.CalledProcessError: the process failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.npz"
        np.savez(path, vertices=mesh.vertices, triangles=mesh.triangles)
        call = [sys.executable, __file__, hand_model, str(path)]
        run = subprocess.run(call, capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(run.stdout)
    return found


def main(hand_model: str, path: str) -> None:
    """Solve once on a small object, then on the mesh, and print what was seen."""
    hand = clench.Hand.load(hand_model)
    _solve_once(hand, clench.GraspObject.load("box:x=0.05,y=0.05,z=0.08"))
    before = _status("VmRSS")["VmRSS"]
    _forget_peak()
    with np.load(path) as arrays:
        obj = clench.GraspObject.from_meshes([(arrays["vertices"], arrays["triangles"])], name="fine")
    _solve_once(hand, obj)
    # One read: of two, the one that comes later may be of more memory than the peak before.
    told = _status("VmHWM", "VmRSS")
    numbers = {"peak_mb": told["VmHWM"], "before_mb": before, "held_mb": told["VmRSS"]}
    print(json.dumps({name: number for name, number in numbers.items() if number is not None}))


def _solve_once(hand: clench.Hand, obj: clench.GraspObject) -> None:
    pose = clench.approach_poses(hand, obj, 1, 0)[0]
    clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, preshape="open"))


def _forget_peak() -> None:
    """Let Linux take the largest memory of this process anew; its compiler may have needed more than any mesh."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def _status(*keys: str) -> dict[str, float | None]:
    """Return numbers that Linux tells about this process at one moment [MB]; None where it tells none."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        lines = []
    told = dict(line.split(":", 1) for line in lines)
    return {key: int(told[key].split()[0]) * 1024 / _MB if key in told else None for key in keys}


if __name__ == "__main__":
    main(*sys.argv[1:])
