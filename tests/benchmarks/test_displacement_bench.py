"""Objects are displaced by what is asked for, and every grasp is tried at every displacement."""

import json

import numpy as np
import pytest

import clench
from benchmarks.bench_commands import main
from benchmarks.holding.displacement_bench import displaced_poses
from clench.models.objects.mass import mass_properties


@pytest.mark.parametrize("distance", [0.0, 0.003, 0.01])
def test_the_centre_of_mass_moves_by_the_distance_and_the_object_turns(distance):
    start = clench.Pose([0.1, 0.2, 0.3], wxyz=[0.5, -0.5, 0.5, 0.5])
    obj = clench.GraspObject.load("mug").posed(start)
    center = mass_properties(obj).center
    poses = displaced_poses(obj, distance, 5, 0)
    assert len(poses) == 5
    for pose in poses:
        assert np.linalg.norm(pose.apply(center) - start.apply(center)) == pytest.approx(distance, abs=1e-12)
        turned = np.arccos(np.clip((np.trace(start.rotation.T @ pose.rotation) - 1.0) / 2.0, -1.0, 1.0))
        assert turned == pytest.approx(np.deg2rad(0.6) * distance * 1e3, abs=1e-6)


def test_the_benchmark_counts_every_grasp_at_every_displacement(capsys):
    arguments = ["--grasps", "1", "--proposals", "64", "--draws", "2", "--distances", "0.0", "0.002", "--json"]
    assert main(["displacement", "--object", "ball", *arguments]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["in_place.0mm"].startswith("1 of 1 held")
    assert " of 2 held" in printed["robust.2mm"]
