"""The oracle against closed forms, against dense sampling, and against answers that are wrong on purpose."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from .cases import SCENES, PlanarCase, cases, make_case, mirrored, placed_vertices, scaled
from .checking import check_answer
from .compiled import Floats
from .planar import StageAnswer, earliest_violation, gap_at, oracle_close, overlaps_at_start
from .scene import PlanarCurve, PlanarFinger, PlanarOutline
from .shapes import rectangle, ring_of_sides, turned

LINK = 0.1


def one_joint(core: Floats, radius: float = 0.0, sense: float = 1.0, limit: float = 3.0) -> PlanarFinger:
    """Return one link that turns about the origin."""
    core = np.asarray(core, dtype=float)
    link = PlanarOutline(0, core, ring_of_sides(len(core)), radius)
    return PlanarFinger(np.zeros((1, 2)), np.array([sense]), np.zeros(1, dtype=int), np.array([limit]), (link,))


def capsule(length: float = LINK, radius: float = 0.005, sense: float = 1.0) -> PlanarFinger:
    """Return a straight round link along +x from the origin."""
    return one_joint(np.array([[0.0, 0.0], [length, 0.0]]), radius, sense)


def disk(distance: float, direction: float, radius: float) -> PlanarCurve:
    """Return one disk by polar coordinates of its centre."""
    return PlanarCurve(disks=np.array([[distance * np.cos(direction), distance * np.sin(direction), radius]]))


def only_contact(finger: PlanarFinger, curve: PlanarCurve) -> float:
    """Return the angle at which the one stage ends, by contact, as the check agrees."""
    answer = oracle_close(finger, curve)
    assert [stage.ended for stage in answer] == ["contact"]
    assert check_answer(finger, curve, answer).failures == ()
    return answer[0].parameter


@given(
    direction=st.floats(0.9, 2.0),
    distance=st.floats(0.045, 0.09),
    radius=st.floats(0.001, 0.03),
    sense=st.sampled_from([1.0, -1.0]),
)
@settings(max_examples=40, deadline=None)
def test_a_straight_link_meets_a_circle_where_the_closed_form_says(
    direction: float, distance: float, radius: float, sense: float
) -> None:
    angle = only_contact(capsule(sense=sense), disk(distance, sense * direction, radius))
    assert angle == pytest.approx(direction - np.arcsin((radius + 0.005) / distance), abs=1e-9)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_side_gives_way_to_the_tip_at_the_touch_length(sense: float) -> None:
    distance, direction, radius, w = 0.08, 1.2, 0.02, 0.005
    touch = np.sqrt(distance**2 - (radius + w) ** 2)
    side = direction - np.arcsin((radius + w) / distance)
    assert only_contact(capsule(touch + 1e-6, w, sense), disk(distance, sense * direction, radius)) == pytest.approx(
        side
    )
    short = touch - 0.004
    spread = (radius + w - (short - distance)) * (radius + w + (short - distance)) / (4 * short * distance)
    tip = direction - 2 * np.arcsin(np.sqrt(spread))
    found = only_contact(capsule(short, w, sense), disk(distance, sense * direction, radius))
    assert found == pytest.approx(tip, abs=1e-9)
    assert found > side + 1e-4


def test_a_circle_beyond_the_tip_is_never_met() -> None:
    answer = oracle_close(capsule(), disk(LINK + 0.005 + 0.02 + 1e-9 * 2, 1.0, 0.02))
    assert answer == (StageAnswer(0, 3.0, "limit"),)


@pytest.mark.parametrize("w", [0.0, 0.004])
def test_a_side_meets_the_corner_of_a_box(w: float) -> None:
    finger = one_joint(rectangle(0.0, LINK, -0.006, 0.006), w)
    corner = np.array([0.06, 0.05])
    box = PlanarCurve((corner + turned(rectangle(0.0, 0.03, 0.0, 0.03), 1.0),))
    expected = np.arctan2(*corner[::-1]) - np.pi / 2 + np.arccos((0.006 + w) / np.hypot(*corner))
    assert only_contact(finger, box) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("w", [0.0, 0.004])
def test_a_corner_of_the_link_meets_the_face_of_a_box(w: float) -> None:
    finger = one_joint(rectangle(0.0, LINK, -0.006, 0.006), w)
    slab = PlanarCurve((rectangle(-0.2, 0.2, 0.07, 0.09),))
    reach, phase = np.hypot(LINK, 0.006), np.arctan2(0.006, LINK)
    expected = -np.pi / 2 - phase + np.arccos((-0.07 + w) / reach)
    assert only_contact(finger, slab) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("tilt", [0.0, 0.7, 2.0])
def test_a_side_meets_an_ellipse_where_a_root_finder_says(tilt: float) -> None:
    a, b, w, center = 0.03, 0.012, 0.005, np.array([0.02, 0.06])

    def clearance(angle: float) -> float:
        normal = np.array([-np.sin(angle), np.cos(angle)])
        local = turned(normal[None], -tilt)[0] * [a, b]
        return float(center @ normal - np.hypot(*local) - w)

    angle = brentq(clearance, 0.0, np.arctan2(*center[::-1]), xtol=1e-15)
    local = turned(np.array([[np.sin(angle), -np.cos(angle)]]), -tilt)[0]
    support = np.array([a * a, b * b]) * local / np.hypot(a * local[0], b * local[1])
    touch = np.arctan2(support[1] / b, support[0] / a)
    around = touch + np.linspace(0, 2 * np.pi, 60, endpoint=False)
    loop = turned(np.column_stack([a * np.cos(around), b * np.sin(around)]), tilt) + center
    assert only_contact(capsule(), PlanarCurve((loop,))) == pytest.approx(angle, abs=1e-9)


def test_two_coupled_joints_meet_a_disk_where_a_root_finder_says_also_with_the_follower_at_its_limit() -> None:
    pivots = np.array([[0.0, 0.0], [0.05, 0.0]])
    tip = PlanarOutline(1, np.array([[0.04, 0.0]]), ring_of_sides(1), 0.006)
    center = np.array([0.055, 0.055])
    for limit in (2.0, 0.2):
        finger = PlanarFinger(pivots, np.array([1.0, 0.7]), np.zeros(2, dtype=int), np.array([1.5, limit]), (tip,))

        def clearance(s: float, limit: float = limit) -> float:
            knee, bend = 0.05 * np.array([np.cos(s), np.sin(s)]), s + min(0.7 * s, limit)
            return float(np.hypot(*(knee + 0.04 * np.array([np.cos(bend), np.sin(bend)]) - center)) - 0.016)

        grid = np.linspace(0, 1.5, 4000)
        first = next(i for i, s in enumerate(grid) if clearance(s) < 0)
        expected = brentq(clearance, grid[first - 1], grid[first], xtol=1e-15)
        assert (0.7 * expected > limit) == (limit == 0.2)
        curve = PlanarCurve(disks=np.array([[*center, 0.01]]))
        assert only_contact(finger, curve) == pytest.approx(expected, abs=1e-9)


def test_the_angle_of_a_wide_turn_is_not_taken_modulo() -> None:
    finger = one_joint(np.array([[0.05, 0.0]]), 0.004, limit=6.2)
    assert only_contact(finger, disk(0.05, 6.0, 0.004)) == pytest.approx(6.0 - 2 * np.arcsin(0.008 / 0.1), abs=1e-9)


@given(width=st.floats(1e-7, 1e-4), tilt=st.floats(-1.0, 1.0))
@settings(max_examples=25, deadline=None)
def test_a_thin_blade_is_not_stepped_over(width: float, tilt: float) -> None:
    blade = PlanarCurve((turned(rectangle(0.02, 0.2, 0.0, width), 0.8) + np.array([0.0, 0.001 * tilt]),))
    finger = one_joint(rectangle(0.03, LINK, -0.004, 0.0))
    assert only_contact(finger, blade) < 0.85
    past = (StageAnswer(0, finger.travel(0), "limit"),)
    assert earliest_violation(finger, blade, past) is not None


@pytest.mark.parametrize("w", [0.0, 0.003])
@pytest.mark.parametrize("below", [True, False])
def test_touching_at_the_start_blocks_or_leaves_by_where_the_motion_goes(w: float, below: bool) -> None:
    """A face flush with the link's side, and the same face on its back."""
    finger = one_joint(rectangle(0.02, LINK, -0.006, 0.006), w)
    flush = 0.006 + w
    face = rectangle(0.03, 0.08, -flush - 0.01, -flush) if below else rectangle(0.03, 0.08, flush, flush + 0.01)
    answer = oracle_close(finger, PlanarCurve((face,)))
    assert answer[0].ended == ("limit" if below else "contact")
    assert below or answer[0].parameter <= 1e-12
    wrong = StageAnswer(0, 0.0, "contact") if below else StageAnswer(0, finger.travel(0), "limit")
    assert check_answer(finger, PlanarCurve((face,)), (wrong,)).failures != ()


def test_a_touched_distal_joint_is_free_when_the_normal_passes_between_the_pivots() -> None:
    """The tip presses a floor: about the first pivot it goes down, about the second, beyond the touch, it comes up."""
    pivots = np.array([[0.0, 0.0], [0.06, 0.03]])
    hook = PlanarOutline(1, np.array([[-0.02, -0.03]]), ring_of_sides(1), 0.004)
    finger = PlanarFinger(pivots, np.array([-1.0, -1.0]), np.array([0, 1]), np.array([1.0, 0.5]), (hook,))
    floor = PlanarCurve((rectangle(-0.1, 0.1, -0.02, -0.004),))
    answer = oracle_close(finger, floor)
    assert [stage.ended for stage in answer] == ["contact", "limit"]
    assert answer[0].parameter <= 1e-12
    assert check_answer(finger, floor, answer).failures == ()


def test_holes_and_two_sided_lines_stop_a_link_from_within() -> None:
    finger = one_joint(np.array([[0.05, 0.0]]), 0.004)
    cave = PlanarCurve((rectangle(-0.1, 0.1, -0.1, 0.1), rectangle(-0.06, 0.06, -0.06, 0.045)[::-1].copy()))
    expected = np.arcsin((0.045 - 0.004) / 0.05)
    assert not overlaps_at_start(finger, cave)
    assert only_contact(finger, cave) == pytest.approx(expected, abs=1e-9)
    lid = np.array([[-0.1, 0.045], [0.1, 0.045]])
    for line in (lid, lid[::-1].copy()):
        assert only_contact(finger, PlanarCurve(lines=(line,), two_sided=True)) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    "curve",
    [
        PlanarCurve((rectangle(-1.0, 1.0, -1.0, 1.0),)),
        PlanarCurve((rectangle(0.05, 0.051, -0.001, 0.001),)),
        PlanarCurve((rectangle(0.05, 0.0501, -1.0, 1.0),)),
        PlanarCurve(disks=np.array([[0.05, 0.0, 0.001]])),
        PlanarCurve(disks=np.array([[0.05, 0.0, 1.0]])),
    ],
    ids=["link in object", "object in link", "blade through", "disk in link", "link in disk"],
)
@pytest.mark.parametrize("w", [0.0, 0.003])
def test_every_way_to_overlap_at_the_start_is_seen(curve: PlanarCurve, w: float) -> None:
    finger = one_joint(rectangle(0.0, LINK, -0.006, 0.006), w)
    assert overlaps_at_start(finger, curve)
    assert check_answer(finger, curve, ()).overlaps_at_start
    assert gap_at(finger, curve, np.zeros(1)) < -1e-5


def boundary(points: Floats, closed: bool, count: int = 400) -> Floats:
    """Return samples along a polyline, ends included."""
    after = np.roll(points, -1, axis=0) if closed else points[1:]
    t = np.linspace(0, 1, count)[:, None]
    return np.concatenate([a + t * (b - a) for a, b in zip(points, after, strict=False)])


@pytest.mark.parametrize("index", range(40))
def test_a_positive_gap_is_the_distance_that_sampling_finds(index: int) -> None:
    case = make_case(11, index)
    start = np.zeros(case.finger.dofs)
    gap = gap_at(case.finger, case.curve, start)
    if gap <= 0.0:
        assert overlaps_at_start(case.finger, case.curve) or gap > -case.finger.tolerance
        return
    curve = [boundary(p, True) for p in case.curve.loops] + [boundary(p, False) for p in case.curve.lines]
    sampled, spacing = np.inf, 0.0
    for o, outline in enumerate(case.finger.outlines):
        core = boundary(placed_vertices(case.finger, start, o), True, 60)
        for samples in curve:
            far = np.linalg.norm(core[:, None] - samples[None], axis=2).min()
            sampled = min(sampled, far - outline.radius)
            spacing = max(spacing, np.linalg.norm(np.diff(samples, axis=0), axis=1).max())
        spacing = max(spacing, np.linalg.norm(np.diff(core, axis=0), axis=1).max())
        for x, z, radius in case.curve.disks:
            sampled = min(sampled, np.linalg.norm(core - [x, z], axis=1).min() - radius - outline.radius)
    assert gap - 1e-12 * case.finger.length <= sampled <= gap + spacing


def solved(seed: int, count: int) -> list[tuple[PlanarCase, tuple[StageAnswer, ...]]]:
    """Return cases that do not overlap at the start, with the oracle's answers."""
    clear = [case for case in cases(seed, count) if not overlaps_at_start(case.finger, case.curve)]
    return [(case, oracle_close(case.finger, case.curve)) for case in clear]


def test_the_oracle_passes_its_own_check_on_every_kind_of_scene() -> None:
    seen, ends = Counter[str](), Counter[str]()
    for case, answer in solved(3, 500):
        verdict = check_answer(case.finger, case.curve, answer)
        assert verdict.failures == (), (case.name, case.index)
        assert verdict.unresolved == 0
        seen[case.name] += 1
        ends.update(stage.ended for stage in answer)
    assert set(seen) == set(SCENES)
    assert seen.total() > 440
    assert min(ends.values()) > 200


def test_sampling_finds_nothing_before_the_oracles_stop() -> None:
    for case, answer in solved(4, 120):
        finger, parameters = case.finger, np.zeros(case.finger.dofs)
        for stage in answer:
            for share in np.linspace(0, 1, 60):
                parameters[stage.dof] = share * stage.parameter
                gap = gap_at(finger, case.curve, parameters, finger.leader(stage.dof))
                assert gap >= -finger.tolerance * (1 + 1e-6), (case.name, case.index)


def test_wrong_answers_are_refused() -> None:
    """Stop late, stop early, claim a limit: each must be caught wherever a contact ended the first stage."""
    tried = 0
    for case, answer in solved(5, 150):
        first = answer[0]
        if first.ended != "contact" or check_answer(case.finger, case.curve, answer).grazing:
            continue
        late = [replace(first, parameter=min(first.parameter + 2e-3, case.finger.travel(0)))]
        wrongs = [late, [replace(first, parameter=case.finger.travel(0), ended="limit")]]
        if first.parameter > 0.02 and gap_at(case.finger, case.curve, early(case, first)) > case.finger.tolerance:
            wrongs.append([replace(first, parameter=first.parameter - 1e-3)])
        for wrong in wrongs:
            tried += 1
            assert check_answer(case.finger, case.curve, (*wrong, *answer[1:])).stages[0].failures, (
                case.name,
                case.index,
            )
    assert tried > 150


def early(case: PlanarCase, first: StageAnswer) -> Floats:
    """Return the parameters with the first degree of freedom a little short of its stop."""
    parameters = np.zeros(case.finger.dofs)
    parameters[0] = first.parameter - 1e-3
    return parameters


def test_an_answer_without_a_stage_or_beyond_a_limit_is_refused() -> None:
    finger, curve = capsule(), disk(0.08, 1.0, 0.02)
    assert check_answer(finger, curve, ()).failures != ()
    assert check_answer(finger, curve, (StageAnswer(0, 3.1, "limit"),)).failures != ()
    assert check_answer(finger, curve, (StageAnswer(0, -0.1, "contact"),)).failures != ()


@pytest.mark.parametrize("index", range(12))
def test_the_mirror_image_and_the_enlarged_scene_close_the_same(index: int) -> None:
    case = make_case(8, index)
    if overlaps_at_start(case.finger, case.curve):
        assert overlaps_at_start(*mirrored(case.finger, case.curve))
        return
    here = oracle_close(case.finger, case.curve)
    for image in (mirrored(case.finger, case.curve), scaled(case.finger, case.curve, 64.0)):
        there = oracle_close(*image)
        assert [a.ended for a in there] == [a.ended for a in here]
        if not check_answer(case.finger, case.curve, here).grazing:
            np.testing.assert_allclose([a.parameter for a in there], [a.parameter for a in here], atol=1e-6)


def test_a_case_is_the_same_whenever_it_is_made() -> None:
    again = [make_case(2, i) for i in (7, 3)]
    for case, same in zip(again, (list(cases(2, 8))[7], list(cases(2, 8))[3]), strict=True):
        assert case.name == same.name
        np.testing.assert_array_equal(case.curve.segments, same.curve.segments)
        np.testing.assert_array_equal(case.finger.limits, same.finger.limits)
