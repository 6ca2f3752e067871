"""The devices that can solve a batch: the processor, or a CUDA device."""

from __future__ import annotations

from typing import Final

from clench.core.exceptions import CommandError

CPU: Final = "cpu"
CUDA: Final = "cuda"
DEVICES: Final = (CPU, CUDA)


def why_not(device: str) -> str | None:
    """Return a sentence that says why a device is not available, or None if it is.

    Raises:
        CommandError: there is no such kind of device.
    """
    if device not in DEVICES:
        raise CommandError(f"device: expected one of {', '.join(DEVICES)}, got {device!r}.")
    if device == CPU:
        return None
    try:
        from clench.kernels.closing.cuda_closing import why_no_device
    except ImportError as error:
        return f"Device 'cuda' cannot be used ({error}); expected the packages of clench[cuda]."
    reason = why_no_device()
    return None if reason is None else f"Device 'cuda' cannot be used: {reason}"
