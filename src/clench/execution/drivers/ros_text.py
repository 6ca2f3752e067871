"""Publish one text on a ROS 2 topic (std_msgs/String), through `rclpy` or, without a ROS installation, `cyclonedds`."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from clench.execution.hardware.driver import DriverError

from .ros2 import LOOK, RosInterface, installed_interface

#: Number of times that a text is sent, and the pause between them [s].
TIMES: Final = 3
SPACING: Final = 0.25


def publish_text(topic: str, text: str, domain: int, timeout: float) -> None:
    """Publish a text, three times, once somebody listens, and wait until it was received, at most so long in all [s].

    Raises:
        CommandError: neither rclpy nor cyclonedds is installed. DriverError: no subscriber.
    """
    through = installed_interface(RosInterface.AUTO)
    send = _by_rclpy if through is RosInterface.RCLPY else _by_cyclonedds
    if not send(topic, text, domain, time.monotonic() + timeout):
        raise DriverError(f"Nobody listens on '{topic}' (waited {timeout:g} s, domain {domain}, {through}).")


def _wait(listeners: Callable[[], int], until: float) -> bool:
    while time.monotonic() < until:
        if listeners():
            return True
        time.sleep(LOOK)
    return False


def _repeat(send: Callable[[], None]) -> None:
    """Send the same a few times: a listener that was found may itself not have found us yet, and miss the first."""
    for k in range(TIMES):
        time.sleep(SPACING if k else 0.0)
        send()


def _by_rclpy(topic: str, text: str, domain: int, until: float) -> bool:
    from rclpy.duration import Duration
    from std_msgs.msg import String

    from .rclpy_link import joined

    with joined(domain) as node:
        publisher = node.create_publisher(String, topic, 10)
        if not _wait(publisher.get_subscription_count, until):
            return False
        _repeat(lambda: publisher.publish(String(data=text)))
        publisher.wait_for_all_acked(Duration(seconds=max(0.0, until - time.monotonic())))
    return True


def _by_cyclonedds(topic: str, text: str, domain: int, until: float) -> bool:
    from cyclonedds.core import DDSException
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic

    from .cyclone_link import flush, prepare_domain, quality
    from .dds_messages import String

    prepare_domain(domain)
    participant = DomainParticipant(domain)
    writer = DataWriter(participant, Topic(participant, f"rt{topic}", String), qos=quality(reliable=True))
    if not _wait(lambda: len(writer.get_matched_subscriptions()), until):
        return False
    try:
        _repeat(lambda: writer.write(String(text)))
    except DDSException as error:
        raise DriverError(f"Nothing could be sent on '{topic}' ({error.msg}).") from None
    flush(writer, max(0.0, until - time.monotonic()))
    return True
