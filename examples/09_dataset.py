"""Generate a small dataset of grasps, read it in batches, and solve one of its grasps again."""

import sys
from pathlib import Path

import clench
import clench.dataset

if __name__ == "__main__":  # worker processes import this file
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clench_out") / "dataset"
    job = clench.dataset.DatasetJob(
        hands=("robonaut2",), objects=("ball", "box:x=0.05,y=0.05,z=0.1"), count=4, effort=8
    )
    try:
        report = clench.dataset.generate(job, folder, workers=0)  # in this process; all cores without it
    except clench.ClenchError as error:  # without pyarrow, for example
        sys.exit(f"{error}")
    assert report.merged is not None
    size = report.merged.bytes / report.merged.rows
    print(f"{report.merged.ok} grasps in {report.merged.file.name}, {size:.0f} bytes each")

    dataset = clench.dataset.open(folder)
    box = dataset.filter(ok=True, object_model="box:x=0.05,y=0.05,z=0.1", epsilon=(0.01, None))
    for batch in box.batches(2, ["T_object_palm", "pregrasp", "touch", "squeeze", "epsilon"]):
        print(f"touch {batch['touch'].shape}, epsilon {batch['epsilon'].round(3)}")

    solution = box.solution(0)  # loads the models that the row names, and solves its command
    assert list(solution.joint_angles.values()) == box.row(0)["touch"]  # the same bits
    assert isinstance(box.command(0), clench.GraspCommand)
    print(f"solved again: {solution.status}, {len(solution.contacts)} contacts")
