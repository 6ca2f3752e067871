"""The panel that plays the motion and tests the hold."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from clench.apps.viewer.motion.motion_player import MotionPlayer
from clench.apps.viewer.motion.motion_track import Frame, MotionTrack, Recorder, planned_track
from clench.apps.viewer.session.live_session import LiveSession
from clench.apps.viewer.session.settled_answer import SettledAnswer
from clench.core.defaults import FRICTION
from clench.core.exceptions import ClenchError
from clench.execution.simulation.hold import Hold, HoldReport, HoldTest
from clench.execution.simulation.piece_hold import hold_as_collided
from clench.execution.trajectory import plan_trajectory

from .user_events import when_set

if TYPE_CHECKING:
    import viser

_SPEEDS: Final = {"1×": 1.0, "1/2×": 0.5, "1/4×": 0.25, "1/10×": 0.1}


class PlayPanel:
    """Play, scrub and slow down a motion; try whether the grasp holds.

    Args:
        server: of viser. session: whose answer is played. show: draws one frame. back: draws the answer again.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        session: LiveSession,
        show: Callable[[Frame], None],
        back: Callable[[], None],
    ) -> None:
        self._session, self._draw, self._back = session, show, back
        self.player = MotionPlayer(self._show)
        self._of: SettledAnswer | None = None
        self._testing = threading.Lock()
        gui = server.gui
        self._buttons = gui.add_button_group("Motion", ("Play", "Pause", "Reset"))
        self._place = gui.add_slider("Place [%]", 0.0, 100.0, 0.5, 0.0)
        self._speed = gui.add_dropdown("Speed", tuple(_SPEEDS))
        self._phase = gui.add_markdown("Open, touch, squeeze, lift.")
        gui.add_divider()
        self._test = gui.add_dropdown(
            "Hold test", tuple(map(str, HoldTest)), hint="Pulls in six directions, or a lift off a table; in MuJoCo."
        )
        self._try = gui.add_button("Test the hold")
        self._result = gui.add_markdown("")
        self._buttons.on_click(lambda event: self._press(event.target.value))
        when_set(self._place, self._scrub)
        when_set(self._speed, self._slow_down)
        self._try.on_click(lambda _: self._hold())

    def stop(self) -> None:
        """Let go of the motion: the user has moved something."""
        self.player.load(None)
        self._of = None

    def track(self) -> MotionTrack | None:
        """Return the motion of the newest answer, planned if need be; None where there is none, which is said."""
        settled = self._session.settled
        if settled is None:
            self._phase.content = "There is no answer to play yet."
            return None
        if self._of is not settled or self.player.track is None:
            self._phase.content = "Planning the motion …"
            try:
                self.player.load(planned_track(settled))
            except ClenchError as error:
                self._phase.content = f"No motion: {error}"
                return None
            self._of = settled
        return self.player.track

    def _press(self, what: str) -> None:
        if what == "Pause":
            self.player.pause()
        elif what == "Reset":
            self.stop()
            self._place.value = 0.0
            self._phase.content = ""
            self._back()
        elif self.track() is not None:
            self.player.play()

    def _scrub(self, place: float) -> None:
        if self.track() is not None:
            self.player.go_to(place / 100.0)

    def _slow_down(self, name: str) -> None:
        self.player.speed = _SPEEDS[name]

    def _show(self, frame: Frame, share: float) -> None:
        self._draw(frame)
        self._place.value = round(200.0 * share) / 2.0
        track = self.player.track
        note = f"  \n{track.note}" if track is not None and track.note else ""
        self._phase.content = f"**{frame.phase}**{note}"

    def _hold(self) -> None:
        settled = self._session.settled
        if settled is None or not self._testing.acquire(blocking=False):
            return
        try:
            self._result.content = "Testing …"
            self._result.content = self._tested(settled)
        except ClenchError as error:
            self._result.content = f"Not tested: {error}"
        finally:
            self._testing.release()

    def _tested(self, settled: SettledAnswer) -> str:
        quick = settled.quick
        state, solution = quick.state, settled.solution
        test = Hold(mass=state.mass, friction=state.friction or FRICTION, test=HoldTest(self._test.value))
        way = plan_trajectory(solution, quick.hand, obj=quick.obj, force=True)
        recorder = Recorder(solution.hand_pose)
        report = hold_as_collided(solution, quick.hand, quick.obj, test, way, film=recorder)
        track = recorder.track("Simulated; the arrows are measured forces.")
        if track is not None and self._session.settled is settled:
            self.player.load(track)
            self._of = settled
            self.player.play()
        return hold_text(report)


def hold_text(report: HoldReport) -> str:
    """Return what came of a hold test, as Markdown."""
    head = f"**{'✓ Held' if report.held else '✕ Not held'}.** {report.reason}"
    if not report.forces:
        return head
    rows = [f"| {name} | {f.planned:z.2f} | {f.measured:z.2f} |" for name, f in report.forces.items()]
    table = "\n".join(["| finger | planned [N] | measured [N] |", "|---|---:|---:|", *rows])
    return f"{head}\n\n{table}"
