"""Warning class of the package."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass


class FringetraceWarning(UserWarning):
    """Warning that an image cannot be trusted: where, by how much, and the remedy."""
