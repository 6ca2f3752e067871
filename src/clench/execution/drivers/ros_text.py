"""One text on a ROS 2 topic (std_msgs/String), through `rclpy` or, without a ROS installation, `cyclonedds`."""

from __future__ import annotations

import time
from collections.abc import Callable

from clench.execution.driver import DriverError

from .ros2 import LOOK, RosInterface, installed_interface


def publish_text(topic: str, text: str, domain: int, timeout: float) -> None:
    """Publish a text once somebody listens, and wait until it was received, at most so long altogether [s].

    Raises:
        CommandError: neither rclpy nor cyclonedds is installed. DriverError: nobody listens.
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


def _by_rclpy(topic: str, text: str, domain: int, until: float) -> bool:
    from rclpy.duration import Duration
    from std_msgs.msg import String

    from .rclpy_link import joined

    with joined(domain) as node:
        publisher = node.create_publisher(String, topic, 10)
        if not _wait(publisher.get_subscription_count, until):
            return False
        publisher.publish(String(data=text))
        publisher.wait_for_all_acked(Duration(seconds=max(0.0, until - time.monotonic())))
    return True


def _by_cyclonedds(topic: str, text: str, domain: int, until: float) -> bool:
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
    writer.write(String(text))
    flush(writer, max(0.0, until - time.monotonic()))
    return True
