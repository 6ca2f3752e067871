"""The tests that must notice mistakes in a file, the quickest first; files as in `src/clench`."""

PLANAR = "mutation/few_planar.py"
WIDTH = "mutation/few_width.py"
TWO_SIDED = "kernels/test_two_sided_outlines.py"
ROUND = "kernels/test_round_sections_stop.py"
RATES = "kernels/test_rates_and_starts.py"
TOUCHING = "kernels/test_touching.py"
#: Kernels run as plain Python.
KERNELS = {
    "kernels/sections/turning": ["kernels/test_turning.py", PLANAR],
    "kernels/sections/turning_pairs": ["kernels/test_turning_pairs.py", RATES, PLANAR, TWO_SIDED],
    "kernels/sections/coupled": ["kernels/test_coupled.py", PLANAR],
    "kernels/sections/coupled_pairs": ["kernels/test_coupled_pairs.py", PLANAR, TWO_SIDED],
    "kernels/sections/outline_sweep": ["kernels/test_outline_sweep.py", PLANAR, ROUND],
    "kernels/sections/outline_gap": ["kernels/test_outline_gap.py", ROUND, TOUCHING, "kernels/test_overlap.py"],
    "kernels/sections/plane_contact": [ROUND, TOUCHING],
    "kernels/sections/plane_sections": ["kernels/test_section_circles.py", PLANAR],
    "kernels/closing/segments": ["kernels/test_segments.py"],
    "kernels/geometry/core_distance": ["kernels/test_closest.py", "kernels/test_sweep_pairs.py"],
    "kernels/geometry/mesh_clearance": ["kernels/test_apart.py"],
    "kernels/geometry/obb": ["kernels/test_slabs.py", "grasp/test_boxes.py"],
    "kernels/toi/core_motion": ["kernels/test_core_motion.py", "kernels/test_spatial_motion.py"],
    "kernels/toi/toi_pairs": ["kernels/test_sweep_pairs.py", "kernels/test_leaving.py"],
    "kernels/toi/separating": ["kernels/test_leaving.py", "kernels/test_sweep_pairs.py"],
    "kernels/toi/toi_bounds": ["kernels/test_earliest.py", "kernels/test_spatial_sweep.py"],
    "kernels/toi/spatial_motion": ["kernels/test_spatial_motion.py", "kernels/test_spatial_sweep.py"],
    "kernels/toi/toi_work": ["kernels/test_nearness.py", "grasp/test_boxes.py", WIDTH],
    "kernels/toi/toi_translation": ["kernels/test_translation.py"],
    "kernels/toi/toi_bodies": ["kernels/test_body_sweep.py"],
    "kernels/toi/separating_planes": ["kernels/test_body_sweep.py"],
    "kernels/toi/pair_queue": ["kernels/test_body_sweep.py"],
}
#: What is no kernel runs with compiled kernels.
STEPS = {
    "closing/feasibility": ["grasp/test_feasibility.py"],
    "closing/collision/reach": ["solver/test_causes.py"],
    "solver/certificate": ["solver/test_certificate.py", "solver/test_statuses.py", "grasp/test_containment.py"],
    "solver/analysis/record": ["solver/test_record.py"],
    "execution/landing": ["execution/test_landing.py"],
    "models/hand/understanding/coupling": ["models/hand/test_hand_coupling.py"],
    "models/hand/reading/limits": ["models/hand/test_hand_findings.py"],
    "models/objects/mass": ["models/objects/test_mass.py"],
    "apps/figures/__init__": [
        "apps/test_figures_of_odd_hands.py",
        "apps/test_figures.py",
        "apps/test_plan_pictures.py",
    ],
    "apps/cli/interrupts": ["apps/test_interrupts.py"],
}
TESTS = {**KERNELS, **STEPS}
