"""The page: the scene, the panels beside it, and what dragging does."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench.core.pose import Pose
from clench.models.shapes import CollisionSource

from .grasps.listed_grasp import ListedGrasp
from .motion.motion_track import Frame
from .panels.browse_panel import BrowsePanel
from .panels.grasp_panel import GraspPanel
from .panels.plane_panel import PlanePanel
from .panels.play_panel import PlayPanel
from .panels.posture_panel import PosturePanel, start_angle
from .panels.save_panel import SavePanel
from .panels.status_card import answer_card, busy_card, failed_card
from .panels.user_events import when_set
from .panels.weights_panel import WeightsPanel
from .scene.camera_place import FIELD_OF_VIEW, ROOM, ROOM_FOR_STRIP, good_view
from .scene.contact_marks import ContactMarks
from .scene.finger_pull import find_pull
from .scene.scene_nodes import SceneNodes
from .session.live_session import LiveSession
from .session.quick_answer import QuickAnswer
from .session.settled_answer import SettledAnswer
from .session.view_state import ViewState

if TYPE_CHECKING:
    import viser

#: The card is written so often while the user drags [s].
_CARD_EVERY: Final = 0.1
#: A pull shows its direction from here on [m].
_SURE: Final = 0.002
#: Colour behind pictures of a dark page.
_DARK: Final = (26, 27, 30)
BRAND: Final = (0, 90, 156)
_OBJECT, _WRIST, _BOTH, _NONE = "Object", "Wrist", "Both", "None"


class ViewerPage:
    """Show a session in all tabs, and turn what happens there into changes of the session.

    Args:
        server: viser's server. session: the session that is shown. grasps: a list to look through. dark: start dark.
    """

    def __init__(
        self, server: viser.ViserServer, session: LiveSession, grasps: Sequence[ListedGrasp] = (), dark: bool = False
    ) -> None:
        self._server, self._session, self._dark = server, session, dark
        self._grasps = list(grasps)
        self._drawing = threading.Lock()
        self._card_at = 0.0
        self._drag: dict[str, Any] = {}
        self._theme()
        self.nodes = SceneNodes(server, self._pull_link, self._pull_object, self._pick)
        self.marks = ContactMarks(server)
        self._build_panels()
        self.nodes.show_gizmos(hand=False, object=True)
        self.nodes.hand_gizmo.on_update(lambda event: self._move_by_gizmo(event, "hand_pose"))
        self.nodes.object_gizmo.on_update(lambda event: self._move_by_gizmo(event, "object_pose"))

    def _theme(self) -> None:
        self._server.gui.configure_theme(
            dark_mode=self._dark, brand_color=BRAND, show_logo=False, show_share_button=False, control_width="large"
        )
        scene = self._server.scene
        scene.world_axes.visible = False
        scene.set_up_direction("+z")
        # There is no ground that a shadow could fall on.
        scene.configure_default_lights(enabled=True, cast_shadow=False)

    def _build_panels(self) -> None:
        gui = self._server.gui
        gui.set_panel_label("clench view")
        gui.main_panel.dock_right()
        self._card = gui.add_html(busy_card("Starting …"))
        undo = gui.add_button_group("Step", ("Undo", "Redo"))
        undo.on_click(lambda event: self._session.undo() if event.target.value == "Undo" else self._session.redo())
        handles = gui.add_button_group("Handles", (_OBJECT, _WRIST, _BOTH, _NONE))
        handles.value = _OBJECT
        handles.on_click(lambda event: self._show_handles(event.target.value))
        tabs = gui.add_tab_group()
        with tabs.add_tab("Grasp"):
            self._grasp_panel = GraspPanel(self._server, self._session)
        with tabs.add_tab("Joints"):
            self._posture_panel = PosturePanel(self._server, self._session)
            self._plane_panel = PlanePanel(self._server)
        with tabs.add_tab("Choice"):
            self._weights_panel = WeightsPanel(self._server, self._session)
        with tabs.add_tab("Play"):
            self.play_panel = PlayPanel(self._server, self._session, self._show_frame, self._show_answer)
        with tabs.add_tab("List"):
            self.browse_panel = BrowsePanel(self._server, self._session, self._grasps)
        with tabs.add_tab("Save"):
            drawing = self._show_frame, self._show_answer, self._paper
            SavePanel(self._server, self._session, self.play_panel, *drawing)
        with gui.add_folder("View", expand_by_default=False):
            self._build_view(gui)

    def _build_view(self, gui: Any) -> None:
        dark = gui.add_checkbox("Dark page", self._dark)
        when_set(dark, self._set_dark)
        for name, words in (("normals", "Normals"), ("cones", "Friction cones"), ("forces", "Forces")):
            box = gui.add_checkbox(words, True)
            when_set(box, partial(self._want, name))

    def _paper(self) -> tuple[int, int, int]:
        return _DARK if self._dark else (255, 255, 255)

    def _set_dark(self, dark: bool) -> None:
        self._dark = dark
        self._theme()

    def _want(self, what: str, wanted: bool) -> None:
        self.marks.wanted[what] = wanted
        with self._drawing:
            self._redraw()

    def _show_handles(self, which: str) -> None:
        self.nodes.show_gizmos(hand=which in (_WRIST, _BOTH), object=which in (_OBJECT, _BOTH))

    # The session calls these methods.

    def adopted(self, state: ViewState) -> None:
        """Show a state in the panels, and move hand, object and handles to it."""
        self._grasp_panel.show(state)
        self._posture_panel.show(state)
        self._weights_panel.show(state)
        obj = self._session.shelf.object(state.object)
        self.nodes.put(state.command.hand_pose, state.command.object_pose or obj.pose)

    def answered(self, answer: QuickAnswer) -> None:
        """Draw an answer."""
        self.play_panel.stop()
        with self._drawing:
            command = answer.state.command
            source = CollisionSource(command.collision_source or answer.hand.default_source)
            if self.nodes.show_models(answer.hand, answer.obj, source):
                self.adopted(self._session.state)
                self._look_at(answer)
            with self._server.atomic():
                self.nodes.bend(answer.hand, answer.joint_angles)
                self._mark(answer)
        now = time.perf_counter()
        if now - self._card_at > _CARD_EVERY:
            self._card_at = now
            self._card.content = answer_card(answer, None)

    def rested(self, answer: SettledAnswer) -> None:
        """Draw forces, and write the exact numbers."""
        with self._drawing, self._server.atomic():
            self._show_forces(answer)
        self._card.content = answer_card(answer.quick, answer)
        self._plane_panel.rested(answer)

    def noted(self, sentence: str) -> None:
        """Show a note about the answer."""
        settled = self._session.settled
        if settled is not None:
            self._card.content = answer_card(settled.quick, settled, sentence)

    def failed(self, sentence: str) -> None:
        """Say what went wrong."""
        self._card.content = failed_card(sentence)

    def busy(self, sentence: str) -> None:
        """Say what takes a while."""
        if sentence:
            self._card.content = busy_card(sentence)

    def _show_frame(self, frame: Frame) -> None:
        """Draw one moment of a motion."""
        answer = self._session.answer
        if answer is None:
            return
        with self._drawing, self._server.atomic():
            self.nodes.put(frame.hand, frame.object, alone=True)
            self.nodes.bend(answer.hand, frame.posture)
            self.marks.hide()
            back = frame.object.inverse()
            self.marks.show_forces(back.apply(frame.points), frame.forces @ back.rotation.T)

    def _show_answer(self) -> None:
        """Draw the newest answer after a motion."""
        answer = self._session.answer
        if answer is None:
            return
        self.adopted(self._session.state)
        with self._drawing, self._server.atomic():
            self.nodes.bend(answer.hand, answer.joint_angles)
            self._redraw()

    def _redraw(self) -> None:
        if self._session.answer is not None:
            self._mark(self._session.answer)
        if self._session.settled is not None:
            self._show_forces(self._session.settled)

    def _mark(self, answer: QuickAnswer) -> None:
        back = self._object_pose(answer.state).inverse()
        self.marks.show(back.apply(answer.positions), answer.normals @ back.rotation.T, answer.friction)

    def _show_forces(self, answer: SettledAnswer) -> None:
        if answer.squeeze is None:
            return
        back = self._object_pose(answer.quick.state).inverse()
        points = np.array([contact.position for contact in answer.squeeze.grasp.contacts]).reshape(-1, 3)
        self.marks.show_forces(back.apply(points), answer.squeeze.forces @ back.rotation.T)

    def _object_pose(self, state: ViewState) -> Pose:
        return state.command.object_pose or self._session.shelf.object(state.object).pose

    def _look_at(self, answer: QuickAnswer) -> None:
        """Point the cameras of all tabs, also of those to come, at hand and object."""
        target, place = good_view(answer, self._object_pose(answer.state), ROOM_FOR_STRIP if self._grasps else ROOM)
        camera = self._server.initial_camera
        camera.look_at, camera.position, camera.fov = target, place, FIELD_OF_VIEW
        for client in self._server.get_clients().values():
            with client.atomic():
                # In this order: a new position takes the point that is looked at along.
                client.camera.position, client.camera.look_at = place, target
                client.camera.fov = FIELD_OF_VIEW

    # The user's actions.

    def _move_by_gizmo(self, event: Any, key: str) -> None:
        pose = Pose(event.target.position, event.target.wxyz)
        if key == "object_pose":
            self.nodes.put_around(pose)
        self._session.drag(lambda state: state.moved(**{key: pose}), moving=event.phase != "end")

    def _pull_object(self, event: Any) -> None:
        """Move the object in the plane of the picture."""
        gizmo = self.nodes.object_gizmo
        if event.phase == "start":
            self._drag["object"] = np.array(event.start_position), np.array(gizmo.position)
        if "object" not in self._drag:
            return
        grabbed, begin = self._drag["object"]
        gizmo.position = begin + np.array(event.end_position) - grabbed
        pose = Pose(gizmo.position, gizmo.wxyz)
        self.nodes.put_around(pose)
        self._session.drag(lambda state: state.moved(object_pose=pose), moving=event.phase != "end")

    def _pull_link(self, link: int, event: Any) -> None:
        """Turn the joint of the preshape that follows the pull; the palm moves the wrist."""
        answer = self._session.answer
        if answer is None:
            return
        end = np.array(event.end_position)
        if event.phase == "start":
            self._drag["link"] = np.array(event.start_position), self.nodes.hand_gizmo.position.copy(), None
        if "link" not in self._drag:
            return
        grabbed, palm_at, pull = self._drag["link"]
        hand = answer.hand
        moving = event.phase != "end"
        if link in hand.fixed_links or link == hand.palm:
            gizmo = self.nodes.hand_gizmo
            gizmo.position = palm_at + end - grabbed
            pose = Pose(gizmo.position, gizmo.wxyz)
            self._session.drag(lambda state: state.moved(hand_pose=pose), moving=moving)
            return
        if pull is None:
            way = end - grabbed
            pull = find_pull(hand, answer.joint_angles, answer.state.command.hand_pose, link, grabbed, way)
            if pull is None or not np.linalg.norm(way) > _SURE:
                return
            begin = start_angle(hand, answer.state, hand.joints[pull.joint].name)
            self._drag["link"] = grabbed, palm_at, (pull, begin)
        else:
            pull, begin = pull
        joint = hand.joints[pull.joint]
        angle = min(max(begin + pull.angle(end - grabbed), joint.lower), joint.upper)
        self._session.drag(lambda state: state.with_angle(joint.name, angle), moving=moving)
        self._posture_panel.show(self._session.state)

    def _pick(self, link: int) -> None:
        answer = self._session.answer
        if answer is None:
            return
        finger = next((f for f in answer.hand.fingers if link in f.links), None)
        name = None if finger is None else finger.name
        self._posture_panel.pick(name)
        self._plane_panel.pick(name)
        self.nodes.pick(() if finger is None else finger.links)
