"""The panel of the problem: hand, object, preshape, order, geometry, friction and mass."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from clench.apps.viewer.session.live_session import LiveSession
from clench.apps.viewer.session.view_state import Ask, ViewState
from clench.core.defaults import FRICTION
from clench.models.command import ClosingOrder
from clench.models.shapes import CollisionSource
from clench.solver.preshapes.preshapes import opposition_zones

from .user_events import when_set

if TYPE_CHECKING:
    import viser

#: Choices of the preshape that are no preshape of the hand.
_AS_SET: Final = "as set"
_CLENCH: Final = "let clench choose"
_SAME_ANGLE: Final = 1e-6


class GraspPanel:
    """Show and change the parts of a state besides poses and angles.

    Args:
        server: viser's server. session: the session that the panel changes.
    """

    def __init__(self, server: viser.ViserServer, session: LiveSession) -> None:
        self._session = session
        gui, state = server.gui, session.state
        shelf = session.shelf
        self._hand = gui.add_dropdown("Hand", tuple(shelf.hand_makers), initial_value=state.hand)
        self._object = gui.add_dropdown("Object", tuple(shelf.object_makers), initial_value=state.object)
        self._preshape = gui.add_dropdown("Preshape", (_AS_SET, _CLENCH), initial_value=_AS_SET)
        self._order = gui.add_dropdown(
            "Order", tuple(map(str, ClosingOrder)), hint="In which the joints close: see docs/method.md."
        )
        self._source = gui.add_dropdown(
            "Geometry", tuple(map(str, CollisionSource)), hint="Which geometry of the hand is solved for, and drawn."
        )
        self._friction = gui.add_slider(
            "Friction", 0.05, 1.5, 0.05, state.friction or FRICTION, hint="Of all contacts. The closing ignores it."
        )
        self._mass = gui.add_slider("Mass [kg]", 0.01, 2.0, 0.01, min(max(state.mass, 0.01), 2.0))
        self._plan = gui.add_button("Plan another grasp", hint="Search for a wrist pose and a preshape.")
        self._connect()
        self.show(state)

    def _connect(self) -> None:
        session = self._session
        when_set(self._hand, lambda _: session.change(self._other_hand, Ask.PLAN))
        when_set(self._object, lambda name: session.change(lambda s: replace(s, object=name), Ask.PLAN))
        when_set(self._preshape, self._take_preshape)
        when_set(self._order, lambda name: session.change(lambda s: s.with_order(ClosingOrder(name))))
        when_set(self._source, lambda name: session.change(lambda s: s.with_source(CollisionSource(name))))
        when_set(self._friction, lambda mu: session.slide(lambda s: replace(s, friction=float(mu))))
        when_set(self._mass, lambda mass: session.slide(lambda s: replace(s, mass=float(mass))))
        self._plan.on_click(lambda _: session.plan_another())

    def _other_hand(self, state: ViewState) -> ViewState:
        """Return the state with another hand, whose joints and geometry have other names."""
        plain = replace(state.command, preshape={}, fingers=None, collision_source=None, next_steps=(), speeds={})
        return replace(state, hand=self._hand.value, command=plain)

    def _take_preshape(self, name: str) -> None:
        if name == _CLENCH:
            self._session.change(lambda s: s, Ask.CHOOSE)
        elif name != _AS_SET:
            hand = self._session.shelf.hand(self._session.state.hand)
            angles = {shape.name: shape.angles for shape in opposition_zones(hand)}
            self._session.change(lambda s: s.with_preshape(angles.get(name, s.command.angles)))

    def show(self, state: ViewState) -> None:
        """Show a state in the panel."""
        hand = self._session.shelf.hand(state.hand)
        zones = {shape.name: shape.angles for shape in opposition_zones(hand)}
        options = (_AS_SET, _CLENCH, *zones)
        if tuple(self._preshape.options) != options:
            self._preshape.options = options
        angles = state.command.angles
        same = (n for n, z in zones.items() if all(abs(angles.get(j, 9.0) - a) < _SAME_ANGLE for j, a in z.items()))
        self._preshape.value = next(same, _AS_SET)
        self._hand.value, self._object.value = state.hand, state.object
        self._order.value = str(state.command.order)
        self._source.value = str(state.command.collision_source or hand.default_source)
        self._friction.value = state.friction or FRICTION
        self._mass.value = state.mass
