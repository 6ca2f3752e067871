"""The ORCA hand through its makers' `orca-core`: an example of a third-party hand that is told one target at a time."""

from __future__ import annotations

import contextlib
import importlib.util
import math
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

from clench.core.exceptions import CommandError, FileError
from clench.core.extras import how_to_install
from clench.core.showing.short_repr import described
from clench.execution.hardware.driver import DriverError, DriverLimits, HandState, JointPath


class OrcaDriver:
    """Move an ORCA hand; it speaks degrees, by the names of its `config.yaml`, so a joint map is needed.

    Args:
        config: the hand's `config.yaml`; None: orca-core's configuration of the newest hand.
        mock: move motors in memory, without hardware.
        version: of the hand, e.g. ``"v1"``, when `config` is not given.

    Raises:
        CommandError: orca-core is not installed. FileError: the configuration cannot be used.
    """

    one_target = True

    def __init__(self, config: str | Path | None = None, *, mock: bool = False, version: str | None = None) -> None:
        if importlib.util.find_spec("orca_core") is None:
            raise CommandError(f"orca-core is not installed; {how_to_install('drivers')}.")
        if config is not None and not Path(config).is_file():
            raise FileError(config, "no such file.")
        import orca_core

        kind = orca_core.MockOrcaHand if mock else orca_core.OrcaHand
        self.name = "orca (mock)" if mock else "orca"
        try:
            with _quiet():
                self._hand: Any = kind(
                    config_path=None if config is None else str(Path(config).resolve()), model_version=version
                )
        except (ValueError, KeyError, OSError) as error:
            raise FileError(config or f"orca-core's model {version or ''}".strip(), f"{error}") from None

    def __repr__(self) -> str:
        return described(self, name=self.name)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints in the hand's configuration."""
        return tuple(self._hand.config.joint_ids)

    @property
    def limits(self) -> DriverLimits:
        """Ranges of motion in the hand's configuration [deg]; orca-core would clamp to them without a word."""
        ranges = self._hand.config.joint_roms_dict
        return DriverLimits({name: (float(low), float(high)) for name, (low, high) in ranges.items()})

    def connect(self, timeout: float) -> None:
        """Open the line and switch the motors on, without moving.

        Raises:
            DriverError: no hand answers, or it is not calibrated: a calibration would move every joint to its ends.
        """
        with _trouble():
            there, message = self._hand.connect(interactive=False)
            if not there:
                raise DriverError(f"The ORCA hand does not answer: {message}.")
            if not self._hand.calibrated:
                raise DriverError("The ORCA hand is not calibrated; calibrate it with orca-core, with nothing in it.")
            self._hand.init_joints(move_to_neutral=False)

    def read(self) -> HandState:
        """Read every joint [deg].

        Raises:
            DriverError: the motors do not answer.
        """
        with _trouble():
            positions = self._hand.get_joint_position().as_dict()
            # Without an answer, orca-core repeats the last reading.
            if not self._hand.last_read_ok:
                raise DriverError("The motors of the ORCA hand do not answer.")
        return HandState({name: math.nan if angle is None else float(angle) for name, angle in positions.items()})

    def command(self, path: JointPath) -> None:
        """Send the targets for the moment at which the next path is due."""
        with _trouble():
            self._hand.set_joint_positions(path.at(path.period))

    def stop(self) -> None:
        """Stop the joints at their present angles.

        Raises:
            DriverError: the motors do not report their positions; they stand still at the last target.
        """
        with _trouble():
            if self._hand.is_connected():
                positions = self._hand.get_joint_position()
                # The last reading may be far from the present angles.
                if not self._hand.last_read_ok or None in positions.as_dict().values():
                    raise DriverError("The motors of the ORCA hand do not answer; they hold the last target.")
                self._hand.set_joint_positions(positions)

    def disconnect(self) -> None:
        """Switch the motors off and close the line."""
        with _trouble():
            self._hand.disconnect()


@contextlib.contextmanager
def _trouble() -> Iterator[None]:
    """Turn any error of the hand's own program into one sentence."""
    try:
        with _quiet():
            yield
    except DriverError:
        raise
    except Exception as error:
        raise DriverError(f"The ORCA hand failed ({type(error).__name__}: {error}).") from None


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Drop the output of orca-core in this thread: its failures are raised or returned.

    Other threads, one of which may stop the hand meanwhile, keep their standard output.
    """
    thread = threading.get_ident()
    with _switching:
        if not isinstance(sys.stdout, _Sieve):
            sys.stdout = _Sieve(sys.stdout)
        _quiet_threads.append(thread)
    try:
        yield
    finally:
        with _switching:
            _quiet_threads.remove(thread)
            if not _quiet_threads and isinstance(sys.stdout, _Sieve):
                sys.stdout = sys.stdout.out


_switching = threading.RLock()
#: Threads that are quiet now, as often as they asked for it.
_quiet_threads: list[int] = []


class _Sieve:
    """Pass on written text, except from quiet threads."""

    def __init__(self, out: TextIO) -> None:
        self.out = out

    def write(self, text: str) -> int:
        return len(text) if threading.get_ident() in _quiet_threads else self.out.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.out, name)
