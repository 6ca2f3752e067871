"""The tests that must notice mistakes in a file, the quickest first; files as in `src/clench`."""

PLANAR = "mutation/few_planar.py"
WIDTH = "mutation/few_width.py"
TWO_SIDED = "kernels/sections/test_two_sided_outlines.py"
ROUND = "kernels/sections/test_round_sections_stop.py"
RATES = "kernels/sections/test_rates_and_starts.py"
TOUCHING = "kernels/sections/test_plane_contact.py"
#: Kernels run as plain Python.
KERNELS = {
    "kernels/sections/turning": ["kernels/sections/test_turning.py", PLANAR],
    "kernels/sections/turning_pairs": ["kernels/sections/test_turning_pairs.py", RATES, PLANAR, TWO_SIDED],
    "kernels/sections/coupled": ["kernels/sections/test_coupled.py", PLANAR],
    "kernels/sections/coupled_pairs": ["kernels/sections/test_coupled_pairs.py", PLANAR, TWO_SIDED],
    "kernels/sections/outline_sweep": ["kernels/sections/test_outline_sweep.py", PLANAR, ROUND],
    "kernels/sections/outline_gap": [
        "kernels/sections/test_outline_gap.py",
        ROUND,
        TOUCHING,
        "kernels/sections/test_section_overlap.py",
    ],
    "kernels/sections/plane_contact": [ROUND, TOUCHING],
    "kernels/sections/plane_sections": ["kernels/sections/test_plane_sections.py", PLANAR],
    "kernels/closing/segments": ["kernels/closing/test_segments.py"],
    "kernels/geometry/core_distance": ["kernels/geometry/test_core_distance.py", "kernels/toi/test_toi_pairs.py"],
    "kernels/geometry/mesh_clearance": ["kernels/geometry/test_mesh_clearance.py"],
    "kernels/trees/node_moments": ["kernels/trees/test_node_moments.py"],
    "kernels/trees/obb": ["kernels/trees/test_obb.py", "closing/test_link_bodies.py"],
    "kernels/toi/core_motion": ["kernels/toi/test_core_motion.py", "kernels/toi/test_spatial_motion.py"],
    "kernels/toi/toi_pairs": ["kernels/toi/test_toi_pairs.py", "kernels/toi/test_separating.py"],
    "kernels/toi/separating": ["kernels/toi/test_separating.py", "kernels/toi/test_toi_pairs.py"],
    "kernels/toi/toi_bounds": ["kernels/toi/test_toi_bounds.py", "kernels/toi/test_toi_links.py"],
    "kernels/toi/spatial_motion": ["kernels/toi/test_spatial_motion.py", "kernels/toi/test_toi_links.py"],
    "kernels/toi/toi_work": ["kernels/toi/test_toi_work.py", "closing/test_link_bodies.py", WIDTH],
    "kernels/toi/passing_planes": ["kernels/toi/test_passing_planes.py", "kernels/toi/test_toi_translation.py"],
    "kernels/toi/toi_translation": ["kernels/toi/test_toi_translation.py"],
    "kernels/toi/toi_bodies": ["kernels/toi/test_toi_bodies.py"],
    "kernels/toi/separating_planes": ["kernels/toi/test_toi_bodies.py"],
    "kernels/toi/pair_queue": ["kernels/toi/test_toi_bodies.py"],
}
#: What is no kernel runs with compiled kernels.
STEPS = {
    "closing/feasibility": ["closing/test_feasibility.py"],
    "closing/collision/reach": ["solver/test_causes.py"],
    "solver/certificate": ["solver/test_certificate.py", "solver/test_statuses.py", "closing/test_containment.py"],
    "solver/analysis/record": ["solver/analysis/test_record.py"],
    "execution/landing": ["execution/test_landing.py"],
    "models/hand/understanding/coupling": ["models/hand/understanding/test_coupling.py"],
    "models/hand/reading/limits": ["models/hand/test_hand_checks.py"],
    "models/objects/mass": ["models/objects/test_mass.py"],
    "apps/figures/__init__": [
        "apps/figures/test_figures_of_odd_hands.py",
        "apps/figures/test_figures.py",
        "apps/figures/test_plan_pictures.py",
    ],
    "apps/cli/interrupts": ["apps/cli/test_interrupts.py"],
}
TESTS = {**KERNELS, **STEPS}
