"""Power ledger: where the power of traced light went."""

from __future__ import annotations

from dataclasses import dataclass

from fringetrace.core import short_repr


@dataclass(frozen=True)
class Ledger:
    """Power ledger: incident power by fate, in |amplitude|^2 * m^2 (or rays, where they have no area).

    `truncated` is what was cut off by the number of bounces or by the least amplitude, and branches
    that were not to be followed.
    """

    incident: float
    detected: float
    left: float
    absorbed: float
    truncated: float

    __repr__ = short_repr

    def _repr_html_(self) -> str:
        total = self.incident or 1.0
        rows = "".join(
            f"<tr><th>{name}</th><td>{value:.6g}</td><td>{value / total:.4%}</td></tr>"
            for name, value in vars(self).items()
        )
        head = "<tr><th>power</th><th></th><th>of the incident</th></tr>"
        return f"<table>{head}{rows}</table>"

    @property
    def error(self) -> float:
        """Unaccounted power, relative to the incident power."""
        total = self.detected + self.left + self.absorbed + self.truncated
        return abs(total - self.incident) / self.incident if self.incident else abs(total)

    def __add__(self, other: Ledger) -> Ledger:
        """Sum of two ledgers, item by item."""
        mine, theirs = vars(self), vars(other)
        return Ledger(**{name: mine[name] + theirs[name] for name in mine})
