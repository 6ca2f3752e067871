"""The values of enumerations, written out so that the command line loads without NumPy."""

from __future__ import annotations

from typing import Literal

Source = Literal["engine", "raw", "visual"]
Order = Literal["proximal-first", "together", "fingertip"]
Status = Literal["grasp", "partial", "no_contact", "blocked"]
Kind = Literal["pinch", "tripod", "precision", "power"]
