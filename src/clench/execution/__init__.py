"""Execution: trajectories, simulated and real hands, drivers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clench.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from clench.execution.completing import complete
    from clench.execution.drivers.orca import OrcaDriver
    from clench.execution.drivers.ros2 import Ros2Driver
    from clench.execution.executing import Executor, execute
    from clench.execution.execution_report import ExecutionReport
    from clench.execution.hardware.driver import DriverError, DriverLimits, HandDriver, HandState, JointPath
    from clench.execution.hardware.hardware_hand import HardwareHand
    from clench.execution.hardware.joint_map import JointMap
    from clench.execution.hardware.ready_signal import ReadySignal
    from clench.execution.history import ExecutionHistory
    from clench.execution.pregrasp import plan_pregrasp
    from clench.execution.simulation.convex_pieces import in_pieces
    from clench.execution.simulation.filming import Film
    from clench.execution.simulation.hold import Hold, HoldReport
    from clench.execution.simulation.simulated_hand import SimulatedHand
    from clench.execution.trajectory import Trajectory, plan_trajectory

_HOMES = {
    "DriverError": "clench.execution.hardware.driver",
    "DriverLimits": "clench.execution.hardware.driver",
    "ExecutionHistory": "clench.execution.history",
    "ExecutionReport": "clench.execution.execution_report",
    "Executor": "clench.execution.executing",
    "Film": "clench.execution.simulation.filming",
    "HandDriver": "clench.execution.hardware.driver",
    "HandState": "clench.execution.hardware.driver",
    "HardwareHand": "clench.execution.hardware.hardware_hand",
    "Hold": "clench.execution.simulation.hold",
    "HoldReport": "clench.execution.simulation.hold",
    "JointMap": "clench.execution.hardware.joint_map",
    "JointPath": "clench.execution.hardware.driver",
    "OrcaDriver": "clench.execution.drivers.orca",
    "ReadySignal": "clench.execution.hardware.ready_signal",
    "Ros2Driver": "clench.execution.drivers.ros2",
    "SimulatedHand": "clench.execution.simulation.simulated_hand",
    "Trajectory": "clench.execution.trajectory",
    "complete": "clench.execution.completing",
    "execute": "clench.execution.executing",
    "in_pieces": "clench.execution.simulation.convex_pieces",
    "plan_pregrasp": "clench.execution.pregrasp",
    "plan_trajectory": "clench.execution.trajectory",
}

__all__ = [
    "DriverError",
    "DriverLimits",
    "ExecutionHistory",
    "ExecutionReport",
    "Executor",
    "Film",
    "HandDriver",
    "HandState",
    "HardwareHand",
    "Hold",
    "HoldReport",
    "JointMap",
    "JointPath",
    "OrcaDriver",
    "ReadySignal",
    "Ros2Driver",
    "SimulatedHand",
    "Trajectory",
    "complete",
    "execute",
    "in_pieces",
    "plan_pregrasp",
    "plan_trajectory",
]

__getattr__, __dir__ = lazy_names(__name__, _HOMES)
