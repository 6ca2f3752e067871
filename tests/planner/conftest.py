"""A hand, an object and one plan for all tests of the planner."""

import pytest

import clench


@pytest.fixture(scope="package")
def hand():
    return clench.Hand.load("robonaut2")


@pytest.fixture(scope="package")
def mug():
    return clench.GraspObject.load("mug")


@pytest.fixture(scope="package")
def plan(hand, mug):
    return clench.plan_grasps(hand, mug, 4, effort=16, most=128)
