"""The sliders of the preshape: posture joints of all fingers, and the start of closing joints of the picked one."""

from __future__ import annotations

from functools import partial
from math import degrees, radians
from typing import TYPE_CHECKING, Any

from clench.apps.viewer.session.live_session import LiveSession
from clench.apps.viewer.session.view_state import ViewState
from clench.models.hand.hand import Hand, JointRole
from clench.solver.preshapes.preshapes import posture_joints

from .user_events import when_set

if TYPE_CHECKING:
    import viser


def start_angle(hand: Hand, state: ViewState, joint: str) -> float:
    """Return where a joint is before the hand closes [rad]."""
    return float(state.command.angles.get(joint, hand.joints[hand.joint_index(joint)].open_value))


def joints_to_set(hand: Hand, finger: str | None) -> list[str]:
    """Return the joints that have sliders: those of the posture, and the free closing joints of the picked finger."""
    names = posture_joints(hand)
    followers = {coupling.follower for coupling in hand.couplings}
    if finger is not None:
        free = (j for j in hand.finger(finger).joints if j not in followers)
        names += [hand.joints[j].name for j in free if hand.joints[j].role is JointRole.CLOSING]
    return list(dict.fromkeys(names))


class PosturePanel:
    """Show and change the angles from which the hand closes.

    Args:
        server: viser's server. session: the session that the panel changes.
    """

    def __init__(self, server: viser.ViserServer, session: LiveSession) -> None:
        self._gui, self._session = server.gui, session
        self._note = server.gui.add_markdown("")
        self._folder = server.gui.add_folder("Angles before closing [°]")
        self._sliders: dict[str, Any] = {}
        self._finger: str | None = None
        self._for: tuple[int, str | None] = (0, None)
        self.show(session.state)

    def pick(self, finger: str | None) -> None:
        """Show the closing joints of a finger, too."""
        self._finger = finger
        self.show(self._session.state)

    def show(self, state: ViewState) -> None:
        """Show the angles of a state."""
        hand = self._session.shelf.hand(state.hand)
        if self._finger is not None and self._finger not in [finger.name for finger in hand.fingers]:
            self._finger = None
        if self._for != (id(hand), self._finger):
            self._rebuild(hand, state)
        for joint, slider in self._sliders.items():
            slider.value = round(degrees(start_angle(hand, state, joint)), 1)

    def _rebuild(self, hand: Hand, state: ViewState) -> None:
        for slider in self._sliders.values():
            slider.remove()
        self._sliders, self._for = {}, (id(hand), self._finger)
        names = joints_to_set(hand, self._finger)
        picked = (
            "Click a finger to set its closing joints, too." if self._finger is None else f"Picked: {self._finger}."
        )
        self._note.content = picked if names else f"No joint of this hand has a posture to set. {picked}"
        with self._folder:
            for joint in names:
                j = hand.joints[hand.joint_index(joint)]
                low, high = round(degrees(j.lower), 1), round(degrees(j.upper), 1)
                if not high > low:
                    continue
                now = min(max(round(degrees(start_angle(hand, state, joint)), 1), low), high)
                slider = self._gui.add_slider(joint, low, high, 0.1, now)
                when_set(slider, partial(self._turn, joint))
                self._sliders[joint] = slider

    def _turn(self, joint: str, value: float) -> None:
        hand = self._session.shelf.hand(self._session.state.hand)
        j = hand.joints[hand.joint_index(joint)]
        angle = min(max(radians(value), j.lower), j.upper)
        self._session.slide(lambda s: s.with_angle(joint, angle))
