"""A pincer written here: a thumb of one link and a finger of two coupled links, closing on a ball between them."""

from __future__ import annotations

from pathlib import Path

import fake_driver
import numpy as np
import pytest
from virtual_clock import VirtualClock

from clench.closing.collision.packed_object import hash_bodies, hash_hand
from clench.core.pose import FloatArray, Pose
from clench.models.hand.hand import Coupling, Finger, Hand, Joint, JointRole, Link
from clench.models.objects.grasp_object import Body, GraspObject
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from clench.solver.solution import FingerResult, FingerStatus, GraspSolution, SolutionStatus
from handmade import make_candidate, make_contact, make_solution

BALL_RADIUS, BALL_HEIGHT = 0.02, 0.05
WIDTH = 0.008
PALM_POSE = Pose([0.3, -0.2, 0.5], wxyz=np.array([0.5, 0.5, -0.1, 0.7]))

XML = """
<mujoco model="pincer">
  <compiler angle="radian"/>
  <option gravity="0 0 -9.81"/>
  <worldbody>
    <body name="mount" pos="0.01 0.02 0.03" euler="0.2 0.3 0.5">
      <geom type="sphere" size="0.001" contype="0" conaffinity="0"/>
      <body name="palm" pos="0 0 0.1">
        <geom type="box" size="0.05 0.02 0.004" pos="0 0 -0.015"/>
        <body name="thumb_link" pos="0.04 0 0">
          <joint name="thumb" axis="0 -1 0" range="0 1.5" limited="true" stiffness="1" frictionloss="0.1"/>
          <geom type="capsule" fromto="0 0 0 0 0 0.08" size="0.008"/>
        </body>
        <body name="index_proximal" pos="-0.04 0 0">
          <joint name="index" axis="0 1 0" range="0 1.2" limited="true"/>
          <geom type="capsule" fromto="0 0 0 0 0 0.03" size="0.008"/>
          <body name="index_distal" pos="0 0 0.03">
            <joint name="index_tip" axis="0 1 0" range="0 1.2" limited="true"/>
            <geom type="capsule" fromto="0 0 0 0 0 0.05" size="0.008"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="thumb"/></actuator>
  <equality><joint joint1="index_tip" joint2="index"/></equality>
  <sensor><jointpos joint="thumb"/></sensor>
</mujoco>
"""


def _link(name: str, parent: int, joint: int, position: tuple[float, float, float]) -> Link:
    return Link(name, parent, joint, Pose(position).matrix, {CollisionSource.ENGINE: ()})


def _joint(name: str, sign: float, upper: float, velocity: float | None = None) -> Joint:
    axis = np.array([0.0, sign, 0.0])
    return Joint(name, axis, np.zeros(3), 0.0, upper, velocity=velocity, role=JointRole.CLOSING)


@pytest.fixture
def pincer() -> Hand:
    return Hand(
        name="pincer",
        path=Path("pincer.xml"),
        links=(
            _link("palm", -1, -1, (0, 0, 0)),
            _link("thumb_link", 0, 0, (0.04, 0, 0)),
            _link("index_proximal", 0, 1, (-0.04, 0, 0)),
            _link("index_distal", 2, 2, (0, 0, 0.03)),
        ),
        joints=(_joint("thumb", -1.0, 1.5, 3.0), _joint("index", 1.0, 1.2), _joint("index_tip", 1.0, 1.2, 1.0)),
        couplings=(Coupling(1, 2, 1.0, 0.0),),
        fingers=(Finger("thumb", (1,), (0,), True, 1), Finger("index", (2, 3), (1, 2), False, 3)),
        palm=0,
        fixed_links=(0,),
        allowed_pairs=((0, 1), (0, 2), (2, 3)),
        palm_center=np.zeros(3),
        palm_normal=np.array([0.0, 0.0, 1.0]),
        spec_xml=XML,
    )


@pytest.fixture
def ball() -> GraspObject:
    shape = Shape(ShapeKind.SPHERE, (BALL_RADIUS, 0.0, 0.0))
    return GraspObject("ball", (Body("ball", (shape,)),), pose=PALM_POSE @ Pose([0.0, 0.0, BALL_HEIGHT]))


def thumb_angle() -> float:
    """Closed form: circle and straight link (docs/method.md section 3)."""
    distance = np.hypot(0.04, BALL_HEIGHT)
    return float(np.arctan2(0.04, BALL_HEIGHT) - np.arcsin((BALL_RADIUS + WIDTH) / distance))


def _distal_gap(q: float) -> tuple[float, FloatArray]:
    """Gap [m] between the ball and the distal link of the coupled finger, and its point of contact in the plane."""
    knuckle = np.array([-0.04 + 0.03 * np.sin(q), 0.03 * np.cos(q)])
    along = np.array([np.sin(2 * q), np.cos(2 * q)])
    centre = np.array([0.0, BALL_HEIGHT])
    foot = knuckle + np.clip((centre - knuckle) @ along, 0.0, 0.05) * along
    apart = centre - foot
    distance = float(np.linalg.norm(apart))
    return distance - BALL_RADIUS - WIDTH, foot + apart / distance * WIDTH


def index_angle() -> float:
    low, high = 0.0, 0.6
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if _distal_gap(middle)[0] > 0 else (low, middle)
    return low


@pytest.fixture
def pinch(pincer: Hand, ball: GraspObject) -> GraspSolution:
    """Return the solution of the pincer on the ball, from closed form and bisection."""
    thumb, index = thumb_angle(), index_angle()
    along = np.array([-np.sin(thumb), 0.0, np.cos(thumb)])
    reach = np.sqrt(0.04**2 + BALL_HEIGHT**2 - (BALL_RADIUS + WIDTH) ** 2)
    p_thumb = np.array([0.04, 0.0, 0.0]) + reach * along + WIDTH * np.array([-np.cos(thumb), 0.0, -np.sin(thumb)])
    _, (x, z) = _distal_gap(index)
    points = {"thumb": p_thumb, "index": np.array([x, 0.0, z])}
    links = {"thumb": "thumb_link", "index": "index_distal"}
    angles = {"thumb": {"thumb": thumb}, "index": {"index": index, "index_tip": index}}
    centre = np.array([0.0, 0.0, BALL_HEIGHT])
    contacts = {
        n: make_contact(
            finger=n,
            link=links[n],
            body="ball",
            position=PALM_POSE.apply(p),
            normal=PALM_POSE.rotation @ (p - centre) / BALL_RADIUS,
        )
        for n, p in points.items()
    }
    return make_solution(
        status=SolutionStatus.GRASP,
        geometry_hash=f"{hash_hand(pincer, CollisionSource.ENGINE)}+{hash_bodies(ball.bodies, CollisionSource.RAW)}",
        hand_pose=PALM_POSE,
        object_pose=PALM_POSE @ Pose([0.0, 0.0, BALL_HEIGHT]),
        decomposition={"posture": {}, "closing": {**angles["thumb"], **angles["index"]}},
        joint_angles={**angles["thumb"], **angles["index"]},
        open_angles={"thumb": 0.0, "index": 0.0, "index_tip": 0.0},
        joint_limits={"thumb": (0.0, 1.5), "index": (0.0, 1.2), "index_tip": (0.0, 1.2)},
        contacts=tuple(contacts.values()),
        fingers={
            n: FingerResult(
                n,
                FingerStatus.TOUCH,
                "touches",
                0,
                (make_candidate(joint_angles=angles[n], contacts=(contacts[n],)),),
            )
            for n in ("thumb", "index")
        },
    )


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> VirtualClock:
    """Let driven hands, controllers in memory and the tests' own module look at a clock that no machine holds up."""
    made = VirtualClock()
    made.use(monkeypatch, fake_driver, *[request.module] * hasattr(request.module, "time"))
    return made
