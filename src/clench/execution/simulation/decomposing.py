"""Run CoACD in a process of its own: an assertion in it ends the process that it runs in."""

from __future__ import annotations

import io
import subprocess
import sys
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from clench.core.exceptions import ObjectError
from clench.core.pose import FloatArray
from clench.models.mesh import TriangleMesh

#: Changes to the settings that are tried, one after another: CoACD's own test whether a mesh is manifold ends on some.
ATTEMPTS: Final[tuple[Mapping[str, Any], ...]] = ({}, {"preprocess_mode": "on"})


def decompose(mesh: TriangleMesh, name: str, settings: Mapping[str, Any]) -> tuple[FloatArray, ...]:
    """Return the vertices of convex pieces that approximate a mesh, each of shape (V, 3) [m].

    Args:
        mesh: the mesh. name: of its body. settings: of `coacd.run_coacd`.

    Raises:
        ObjectError: CoACD ended without an answer.
    """
    question = io.BytesIO()
    np.savez(question, vertices=mesh.vertices, triangles=mesh.triangles)
    for changes in ATTEMPTS:
        command = [sys.executable, "-m", __name__, repr({**settings, **changes})]
        run = subprocess.run(command, input=question.getvalue(), capture_output=True, check=False)
        if run.returncode == 0:
            with np.load(io.BytesIO(run.stdout), allow_pickle=False) as data:
                return tuple(data[f"piece_{i}"] for i in range(len(data.files)))
    raise ObjectError(
        f"Body '{name}' cannot be decomposed into convex pieces: CoACD ended {len(ATTEMPTS)} times. Repair the mesh."
    )


def main(settings: Mapping[str, Any], question: bytes) -> bytes:
    """Return the pieces of a mesh as the bytes of an archive.

    Args:
        settings: of `coacd.run_coacd`. question: an archive with `vertices` and `triangles`.
    """
    import coacd

    coacd.set_log_level("error")
    with np.load(io.BytesIO(question), allow_pickle=False) as data:
        parts = coacd.run_coacd(coacd.Mesh(data["vertices"], data["triangles"]), **settings)
    answer = io.BytesIO()
    pieces = {f"piece_{i}": np.asarray(vertices, dtype=np.float64) for i, (vertices, _) in enumerate(parts)}
    np.savez(answer, **pieces)  # type: ignore[arg-type]
    return answer.getvalue()


if __name__ == "__main__":
    import ast
    import os

    # Output of CoACD goes to standard error: standard output is for the answer.
    out = os.dup(1)
    os.dup2(2, 1)
    with os.fdopen(out, "wb") as stream:
        stream.write(main(ast.literal_eval(sys.argv[1]), sys.stdin.buffer.read()))
