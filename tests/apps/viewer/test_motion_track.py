"""The motion that is played, and how it is played."""

from __future__ import annotations

import threading

import numpy as np
import pytest

import clench
from clench.apps.viewer.motion.motion_player import MotionPlayer
from clench.apps.viewer.motion.motion_track import LIFT, Frame, MotionTrack, Recorder, planned_track
from clench.apps.viewer.opening import Given, open_session
from clench.apps.viewer.panels.play_panel import hold_text
from clench.apps.viewer.session.settled_answer import SettledAnswer
from clench.execution.simulation.hold import Hold
from clench.execution.simulation.pulling import hold_and_pull


@pytest.fixture(scope="module")
def settled() -> SettledAnswer:
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("cylinder:r=0.03,h=0.12")
    session = open_session(Given(hand, ball, None, {}, None, 0.1, {"seed": 0}))
    session.begin()
    assert session.wait()
    session.close()
    assert session.settled is not None
    return session.settled


def test_the_motion_goes_from_the_open_hand_over_the_touch_to_the_lift(settled: SettledAnswer) -> None:
    track = planned_track(settled)
    names = [name for _, name in track.phases]
    assert names[-3:] == ["→ touch", "squeeze", "lift"]
    touch = settled.quick.joint_angles
    begin = {name: time for time, name in track.phases}
    np.testing.assert_allclose(track.at(begin["squeeze"]).posture, touch, atol=1e-9)
    np.testing.assert_allclose(
        track.at(0.0).posture, [settled.solution.open_angles[n] for n in settled.quick.hand.joint_names]
    )
    first, last = track.at(0.0), track.at(track.duration)
    assert last.object.position[2] - first.object.position[2] == pytest.approx(LIFT)
    assert last.hand.position[2] - first.hand.position[2] == pytest.approx(LIFT)
    assert not len(first.forces)
    np.testing.assert_allclose(last.forces, settled.squeeze.forces)


def test_a_simulated_hold_is_recorded_with_its_forces(settled: SettledAnswer) -> None:
    quick = settled.quick
    recorder = Recorder(settled.solution.hand_pose)
    way = clench.plan_trajectory(settled.solution, quick.hand, obj=quick.obj)
    report = hold_and_pull(settled.solution, quick.hand, quick.obj, Hold(), way, film=recorder)
    track = recorder.track("")
    assert track is not None
    assert report.held
    assert [name for _, name in track.phases] == ["closing on the free object", "squeezing", "pulling or lifting"]
    squeezed = track.at(track.phases[-1][0] - 0.01)
    assert squeezed.posture.shape == quick.joint_angles.shape
    # Without gravity and before the pull the forces are in balance, and far from 0.
    sizes = np.linalg.norm(squeezed.forces, axis=1)
    assert sizes.sum() > 0.5
    assert np.linalg.norm(squeezed.forces.sum(axis=0)) < 0.05 * sizes.sum()
    assert np.linalg.norm(squeezed.points - squeezed.object.position, axis=1).max() < 0.08
    text = hold_text(report)
    assert "✓ Held" in text
    assert "| thumb |" in text


def track_of(duration: float) -> MotionTrack:
    rows = np.tile([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], (2, 1))
    return MotionTrack(np.array([0.0, duration]), np.array([[0.0], [1.0]]), rows, rows, ((0.0, "only"),))


def test_a_motion_is_played_to_its_end_and_again_from_its_start() -> None:
    seen: list[float] = []
    over = threading.Event()

    def show(frame: Frame, share: float) -> None:
        seen.append(float(frame.posture[0]))
        if share >= 1.0:
            over.set()

    player = MotionPlayer(show)
    player.load(track_of(0.2))
    player.play()
    assert over.wait(10.0)
    player.pause()
    assert seen[0] == 0.0
    assert seen[-1] == 1.0
    assert seen == sorted(seen)
    over.clear()
    player.play()
    assert over.wait(10.0)
    player.pause()
    assert seen[-1] == 1.0
    assert 0.0 in seen[1:]


def test_scrubbing_shows_one_frame_and_stops() -> None:
    seen: list[float] = []
    player = MotionPlayer(lambda frame, share: seen.append(float(frame.posture[0])))
    player.load(track_of(10.0))
    player.play()
    player.go_to(0.25)
    assert not player.is_playing
    assert seen[-1] == pytest.approx(0.25)
