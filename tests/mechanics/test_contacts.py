"""Contacts, frames, cones and the grasp map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clench
from clench.core.defaults import FRICTION
from clench.core.exceptions import CommandError
from clench.mechanics.epsilon.epsilon_quality import cone_faces
from clench.mechanics.grasp.contacts import contact_frames, make_contacts, pair_friction
from clench.mechanics.grasp.grasp_map import grasp_map

from .held_cases import directions, random_contacts


def test_frames_are_right_handed_with_the_normal_last() -> None:
    n = np.vstack([directions(np.random.default_rng(0), 50), np.eye(3), -np.eye(3)])
    frames = contact_frames(n)
    assert np.abs(frames.transpose(0, 2, 1) @ frames - np.eye(3)).max() < 1e-12
    assert np.abs(np.linalg.det(frames) - 1.0).max() < 1e-12
    assert np.array_equal(frames[:, :, 2], n)


@pytest.mark.parametrize("model", ["point", "soft"])
def test_edges_and_faces_describe_one_polyhedron_inside_the_cone(model: str) -> None:
    contacts = random_contacts(np.random.default_rng(1), 3, model)
    edges, faces = contacts.cone_edges(7), cone_faces(contacts, 7)
    values = np.einsum("cfw,cew->cfe", faces, edges)
    assert values.min() > -1e-12
    assert ((np.abs(values) < 1e-12).sum(axis=2) == contacts.width - 1).all()  # every face holds as many edges
    for k in range(edges.shape[1]):
        assert np.abs(contacts.cone_slack(edges[:, k])).max() < 1e-12  # edges lie on the round cone


@pytest.mark.parametrize("model", ["point", "soft"])
def test_grasp_map_adds_forces_and_torques(model: str) -> None:
    rng = np.random.default_rng(2)
    contacts, center, length = random_contacts(rng, 4, model), rng.normal(size=3), 0.3
    forces = rng.normal(size=(4, contacts.width))
    force, torque = np.zeros(3), np.zeros(3)
    for i in range(4):
        pushed = contacts.frames[i] @ forces[i, :3]
        force += pushed
        torque += np.cross(contacts.positions[i] - center, pushed)
        if model == "soft":
            torque += forces[i, 3] * contacts.normals[i]
    wrench = grasp_map(contacts, center, length) @ forces.reshape(-1)
    assert np.allclose(wrench, [*force, *torque / length], atol=1e-12)


def test_friction_of_a_pair_is_the_smaller_one() -> None:
    hand, ball = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    bare, slippery = ball.bodies[0], ball.with_friction(0.2).bodies[0]
    padded = replace(hand, links=tuple(replace(link, friction=0.9) for link in hand.links))
    assert pair_friction(hand, 1, bare) == FRICTION
    assert pair_friction(padded, 1, bare) == 0.9
    assert pair_friction(hand, 1, slippery) == 0.2
    assert pair_friction(padded, 1, slippery) == 0.2


@pytest.mark.parametrize("bad", [0.0, -0.1, np.nan, np.inf])
def test_friction_that_holds_nothing_is_refused(bad: float) -> None:
    with pytest.raises(CommandError, match=r"friction: expected a finite number above 0, got"):
        make_contacts([[0, 0, 0], [1, 0, 0]], [[1, 0, 0], [-1, 0, 0]], [0.5, bad])
    with pytest.raises(clench.ObjectError, match=r"ball: friction: expected a finite number above 0"):
        clench.GraspObject.load("ball").with_friction(bad)


def test_malformed_contacts_are_refused_in_one_sentence() -> None:
    place, n = [[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]]
    with pytest.raises(CommandError, match=r"contacts.normals: expected finite vectors of some length"):
        make_contacts(place, [[0.0, 0.0, 0.0]])
    with pytest.raises(CommandError, match=r"contacts.positions: expected finite numbers"):
        make_contacts([[np.nan, 0.0, 0.0]], n)
    with pytest.raises(CommandError, match=r"contacts.normals: expected shape \(1, 3\), got \(2, 3\)"):
        make_contacts(place, [*n, *n])
    with pytest.raises(CommandError, match=r"contact_model: expected one of point, soft, got 'sticky'"):
        make_contacts(place, n, model="sticky")
    with pytest.raises(CommandError, match=r"contacts.torsion: expected numbers above 0 m, got 0"):
        make_contacts(place, n, model="soft", torsion=0.0)
    contacts = make_contacts(place, n)
    with pytest.raises(CommandError, match=r"edges: expected a whole number of at least 3"):
        contacts.cone_edges(2)
    for length in (0.0, np.nan, -1.0):
        with pytest.raises(CommandError, match=r"length scale: expected a number above 0 m"):
            grasp_map(contacts, np.zeros(3), length)
    with pytest.raises(CommandError, match=r"centre of mass: expected three finite numbers"):
        grasp_map(contacts, [0.0, np.nan, 0.0], 1.0)
