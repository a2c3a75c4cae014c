"""Plan of a trace: scene, light, and where paths end; the same for every thread."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from fringetrace.scene import CCD, Beam, Scene
from fringetrace.tracing.rays import Rays, launch

if TYPE_CHECKING:
    from fringetrace.tracing.intersect.embree import Engine
    from fringetrace.tracing.intersect.on_forms import Formed
    from fringetrace.tracing.optics_table import SceneOptics


class TraceLimits(NamedTuple):
    """Where paths end, as the kernels take it.

    Attributes
    ----------
    screen : 15 floats
        The CCD, see `fringetrace.scene.screen`; zeros if there is none.
    has_screen : bool
    max_bounces : int
    faint : float
        Power, relative to unit amplitude, below which branches are not followed.
    key_base : int
        Base of path keys.
    """

    screen: tuple[float, ...]
    has_screen: bool
    max_bounces: int
    faint: float
    key_base: int


@dataclass(frozen=True, eq=False)
class Plan:
    """Settings of a trace, shared by all threads.

    `passed` are surfaces that rays pass over on their first segment. `warned` are the names of warnings that
    were given; None: there are to be none.
    """

    scene: Scene
    source: Beam | Rays
    ccd: CCD | None
    engine: Engine
    forms: tuple[Formed, ...]
    passed: frozenset[int]
    optics: SceneOptics
    limits: TraceLimits
    record: bool
    warned: set[str] | None = None

    @property
    def total(self) -> int:
        """Number of rays."""
        source = self.source
        return source.shape[0] * source.shape[1] if isinstance(source, Beam) else len(source)

    @property
    def mirrors(self) -> bool:
        """Whether all are ideal mirrors in one body, without forms."""
        return self.optics.surfaces.ideal and len(self.engine.bodies) == 1 and not self.forms

    def rays(self, first: int, stop: int) -> Rays:
        """Range of the rays."""
        source = self.source
        return launch(source, first, stop) if isinstance(source, Beam) else source.part(first, stop)
