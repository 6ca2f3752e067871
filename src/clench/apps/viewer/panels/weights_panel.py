"""The panel of the weights of the criteria, and their effect on the choice of the preshape."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from clench.apps.viewer.session.live_session import LiveSession
from clench.apps.viewer.session.view_state import Ask, ViewState
from clench.scoring.calibration import calibration_of, load_preset, preset_names
from clench.scoring.criterion_registry import criterion_names

from .user_events import when_set

if TYPE_CHECKING:
    import viser

_LARGEST: Final = 5.0
_OWN: Final = "own weights"


class WeightsPanel:
    """Show and change what counts in the choice.

    Args:
        server: viser's server. session: the session that the panel changes.
    """

    def __init__(self, server: viser.ViserServer, session: LiveSession) -> None:
        self._session = session
        gui = server.gui
        gui.add_markdown("What counts when clench chooses the preshape. A new choice may move the fingers.")
        self._preset = gui.add_dropdown("Preset", (*preset_names(), _OWN), initial_value=_OWN)
        self._sliders = {}
        with gui.add_folder("Weights", expand_by_default=False):
            for name in criterion_names():
                slider = gui.add_slider(name.replace("_", " "), 0.0, _LARGEST, 0.05, 0.0)
                when_set(slider, lambda _: self._choose())
                self._sliders[name] = slider
        when_set(self._preset, self._take_preset)
        again = gui.add_button("Choose the preshape again")
        again.on_click(lambda _: session.change(lambda s: s, Ask.CHOOSE))
        self._effect = gui.add_markdown("")
        self.show(session.state)

    def show(self, state: ViewState) -> None:
        """Show the weights of a state, and how preshapes compared."""
        weights = calibration_of(state.command.criteria).weights
        for name, slider in self._sliders.items():
            slider.value = min(round(weights.get(name, 0.0), 2), _LARGEST)
        same = (name for name in preset_names() if dict(load_preset(name).weights) == dict(weights))
        self._preset.value = next(same, _OWN)
        self._effect.content = comparison(self._session.compared)

    def _take_preset(self, name: str) -> None:
        if name != _OWN:
            self._session.change(lambda s: s.with_criteria(name), Ask.CHOOSE)

    def _choose(self) -> None:
        weights = {name: float(slider.value) for name, slider in self._sliders.items()}
        self._session.change(lambda s: s.with_weights(weights), Ask.CHOOSE)


def comparison(compared: Mapping[str, Any] | None) -> str:
    """Return how preshapes compared as Markdown, the best first; empty where none were."""
    if not compared:
        return ""
    entries = sorted(compared["compared"].items(), key=lambda item: -item[1]["total"])
    lines = ["| preshape | status | sum |", "|---|---|---:|"]
    for name, each in entries:
        shown = f"**{name}**" if name == compared["chosen"] else name
        lines.append(f"| {shown} | {each['status'].replace('_', ' ')} | {each['total']:z.3f} |")
    return "\n".join([compared["text"], "", *lines])
