"""The warning class of the package."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass


class FringetraceWarning(UserWarning):
    """An image is not to be trusted: where, by how much, and what to do."""
