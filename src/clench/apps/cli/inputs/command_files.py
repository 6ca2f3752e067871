"""Read command files for the command line: errors about the hand or the criteria name the file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from clench.core.exceptions import ClenchError, CommandError, FileError

if TYPE_CHECKING:
    from clench.models.command import GraspCommand
    from clench.models.hand.hand import Hand


def read_command(path: Path, hand: Hand) -> GraspCommand:
    """Read a command file and check it against a hand and the criteria that exist.

    Raises:
        FileError: the command file, or the calibration file that it names. CommandError: an error in it.
    """
    from clench.models.command_file import check_command, load_command
    from clench.scoring.calibration import calibration_of
    from clench.solver.preshapes.postures import preshape_angles

    command = load_command(path)
    try:
        check_command(hand, command)
        if isinstance(command.preshape, str):
            preshape_angles(hand, command.preshape)
        calibration_of(command.criteria)
    except FileError:
        raise  # names the calibration file
    except ClenchError as error:
        raise CommandError(f"{path}: {error}") from None
    return command


def loadable(model: str) -> str:
    """Return a model's name, or the whole path when it is a file, so that it loads from anywhere."""
    return str(Path(model).resolve()) if os.path.isfile(model) else model
