"""Reference scenes whose field on every pixel is known in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fringetrace import instruments
from fringetrace.core import ComplexArray, FloatArray, mm, nm, rotation, short_repr, um, wavenumber
from fringetrace.geometry import Mesh, forms, shapes
from fringetrace.optics import Mirror
from fringetrace.scene import CCD, Beam, Scene, Surface, pixel_centres

WAVELENGTH = 632.8 * nm
# Gauss points along either side of a pixel: half a wave a pixel is then averaged to 1e-12.
POINTS = 8
# Newton steps to the ray that meets a point: each doubles the digits, the first guess has two.
STEPS = 6
# The beam's own rays are put in by the runs.
GRID = (2, 2)
# How much wider a Michelson's beam is than the pixels looked at: its rim is not in the picture.
WIDER = 1.25
# Of mirrors that lie, and of the rows of their pictures.
UP, ROWS = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])

Truth = tuple[ComplexArray, FloatArray]
Height = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Standard:
    """Reference scene with its beam, CCD and exact field.

    Attributes
    ----------
    title : str
    scene : Scene
        Smooth surfaces have their form.
    beam : Beam
        With any grid of rays.
    ccd : CCD
    truth : callable
        Gives the mean field (rows, columns) complex128 and the mean irradiance (rows, columns) float64
        of each pixel at `WAVELENGTH`.
    """

    title: str
    scene: Scene
    beam: Beam
    ccd: CCD
    truth: Callable[[], Truth]

    __repr__ = short_repr

    @property
    def curved(self) -> bool:
        """Whether facets approximate a curved surface."""
        return any(surface.form is not None for surface in self.scene.surfaces)

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return sum(len(surface.mesh.faces) for surface in self.scene.surfaces)

    def faceted(self) -> Standard:
        """The same scene without exact forms."""
        return replace(self, scene=Scene(tuple(replace(s, form=None) for s in self.scene.surfaces)))

    def lit(self, count: int) -> Beam:
        """The beam with count x count rays."""
        return replace(self.beam, shape=(count, count))


def means(field: Callable[[FloatArray, FloatArray], ComplexArray], ccd: CCD, points: int = POINTS) -> Truth:
    """Mean field and mean irradiance of each pixel, by Gauss quadrature.

    Parameters
    ----------
    field : callable
        Of x along the columns and y along the rows, metres from the CCD's centre; they broadcast.
    ccd : CCD
    points : int
        Along either side of a pixel.

    Returns
    -------
    mean : (rows, columns) complex128
    irradiance : (rows, columns) float64
    """
    nodes, weights = np.polynomial.legendre.leggauss(points)
    rows, columns = ccd.shape
    x, y = (
        ((np.arange(count)[:, None] + 0.5 + 0.5 * nodes).ravel() - 0.5 * count) * ccd.pitch
        for count in (columns, rows)
    )
    values = field(x[None, :], y[:, None]).reshape(rows, points, columns, points)

    def mean(samples: ComplexArray | FloatArray) -> ComplexArray:
        return np.asarray(np.einsum("iajb,a,b->ij", samples, weights / 2.0, weights / 2.0))

    return mean(values), mean(np.abs(values) ** 2).real


def converging(x: FloatArray, y: FloatArray, focal: float, z: float, start: float) -> ComplexArray:
    """Field of a plane wave reflected by the paraboloid z = r^2 / 4 f: a converging spherical wave.

    A ray that comes in at r leaves for the focus at an angle t to the axis with r = 2 f tan(t/2), and
    every path to the focus is start + f long.

    Parameters
    ----------
    x, y : float64, metres
        Points in the plane `z`; they broadcast.
    focal, z, start : float, metres
        Focal length, height of the plane, height at which the phase is 0.

    Returns
    -------
    complex128
    """
    depth = focal - z
    reach = np.sqrt(x * x + y * y + depth**2)
    # r dr / (rho d rho), with tan(t/2) = rho / (depth + reach)
    irradiance = 4.0 * focal**2 * depth / (reach * (reach + depth) ** 2)
    path = start + focal - reach
    return np.asarray(-np.sqrt(irradiance) * _turned(path))


def diverging(x: FloatArray, y: FloatArray, radius: float, z: float, start: float) -> ComplexArray:
    """Field of a plane wave reflected by a convex sphere with its apex in the origin, lit along its axis.

    A ray at r meets the sphere at the angle asin(r / R) to its normal and leaves at twice that to the
    axis; r is found from where it meets the plane by Newton's method.

    Parameters
    ----------
    x, y : float64, metres
        Points in the plane `z`; they broadcast.
    radius, z, start : float, metres
        Of the sphere; height of the plane, to which rays may be carried back; height at which the
        phase is 0.

    Returns
    -------
    complex128
    """
    rho = np.asarray(np.hypot(x, y))
    near = 1.0 / (1.0 + 2.0 * z / radius)
    r = near * rho
    for _ in range(STEPS):
        there, grow, _ = _off_sphere(r, radius, z)
        r = r - (there - rho) / grow
    _, grow, path = _off_sphere(r, radius, z)
    ratio = np.divide(r, rho, out=np.full(rho.shape, near), where=rho > 0.0)
    return np.asarray(-np.sqrt(ratio / grow) * _turned(start + path))


def _off_sphere(r: FloatArray, radius: float, z: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where a ray at r crosses the plane z, the derivative of that, and its path from height 0 on."""
    angle = np.arcsin(r / radius)
    sag = radius * (1.0 - np.cos(angle))
    tangent, cosine = np.tan(2.0 * angle), np.cos(2.0 * angle)
    rise = z + sag
    bend = 2.0 * rise / (cosine**2 * radius * np.cos(angle))
    return r + rise * tangent, 1.0 + np.tan(angle) * tangent + bend, sag + rise / cosine


def _turned(path: FloatArray) -> ComplexArray:
    """exp(i k path), the path reduced first."""
    return np.asarray(np.exp(2j * math.pi * np.fmod(path, WAVELENGTH) / WAVELENGTH))


def _dish(height: Height, side: float, cells: int) -> Mesh:
    """A square of cells x cells under heights z(r^2), corners of the facets on the surface."""
    x = (np.arange(cells + 1) / cells - 0.5) * side
    return shapes.height_map(height(x[None, :] ** 2 + x[:, None] ** 2), side / cells)


def paraboloid(pixels: int, cells: int) -> Standard:
    """Reference scene: a paraboloid of f = 150 mm, seen 90 mm before its focus.

    Parameters
    ----------
    pixels : int
        Along either side of the CCD; here and in all standards below.
    cells : int
        Of the mesh, two facets each, along either side.

    Returns
    -------
    Standard
    """
    focal, z, start, side = 150 * mm, 60 * mm, 90 * mm, 3.6 * mm
    mesh = _dish(lambda square: square / (4.0 * focal), 1.2 * side, cells)
    mirror = Surface(mesh, Mirror(), form=forms.Conic(np.zeros(3), UP, 2.0 * focal, -1.0))
    beam, ccd = _facing(start, side, z, 2 * mm, pixels)
    return Standard(
        "paraboloid before its focus", Scene((mirror,)), beam, ccd,
        lambda: means(lambda x, y: converging(x, y, focal, z, start), ccd),
    )  # fmt: skip


def _facing(start: float, side: float, z: float, width: float, pixels: int) -> tuple[Beam, CCD]:
    """A beam straight down on a mirror at the origin, and a CCD between them that looks down too."""
    beam = Beam(start * UP, -UP, ROWS, (side, side), GRID)
    return beam, CCD(z * UP, -UP, ROWS, width / pixels, (pixels, pixels))


def sphere(pixels: int, cells: int) -> Standard:
    """Reference scene: a convex sphere of R = 400 mm, seen 80 mm above its apex; see `paraboloid`."""
    radius, z, start, side = 400 * mm, 80 * mm, 100 * mm, 3.6 * mm
    beam, ccd = _facing(start, side, z, 4 * mm, pixels)
    return Standard(
        "convex sphere", Scene((_ball(radius, 1.2 * side, cells),)), beam, ccd,
        lambda: means(lambda x, y: diverging(x, y, radius, z, start), ccd),
    )  # fmt: skip


def _ball(radius: float, side: float, cells: int) -> Surface:
    """The top of a sphere with its apex in the origin."""
    mesh = _dish(lambda square: -square / (radius + np.sqrt(radius**2 - square)), side, cells)
    return Surface(mesh, Mirror(), form=forms.Sphere(-radius * UP, radius))


def _michelson(sample: Mesh | Surface, width: float, pixels: int, tilt: float) -> tuple[Scene, Beam, CCD]:
    """A Michelson whose CCD sees the middle of a wider beam."""
    wide = 2 * math.ceil(0.5 * WIDER * pixels) + pixels % 2
    bench = instruments.michelson(
        sample, aperture=width * wide / pixels, pixels=(wide, wide), reference_tilt=(tilt, 0.0)
    )
    return bench.scene, bench.beam, replace(bench.ccd, shape=(pixels, pixels))


def reference(x: FloatArray, tilt: float, arm: float) -> ComplexArray:
    """Plane wave of a Michelson's reference mirror, in the plane that its CCD sees.

    Parameters
    ----------
    x : float64, metres
        Along the tilt.
    tilt : float, radians
    arm : float, metres

    Returns
    -------
    complex128
        A quarter of the power, once there and once back through a 50/50 splitter; less what a tube
        of light that arrives aslant is spread over.
    """
    wave = _turned(2.0 * arm + x * math.sin(2.0 * tilt))
    return np.asarray(-0.5j * math.sqrt(math.cos(2.0 * tilt)) * wave)


def newton_rings(pixels: int, cells: int) -> Standard:
    """Reference scene: rings of a convex sphere of R = 500 mm against a tilted flat, in a Michelson."""
    radius, width, tilt = 500 * mm, 3 * mm, 0.5e-3
    sample = replace(_ball(radius, 2.0 * width, cells), name="sample")
    scene, beam, ccd = _michelson(sample, width, pixels, tilt)
    arm = 0.5 * ccd.focus

    def field(x: FloatArray, y: FloatArray) -> ComplexArray:
        return 0.5j * diverging(x, y, radius, 0.0, 2.0 * arm) + reference(x, tilt, arm)

    return Standard("rings of a sphere on a tilted flat", scene, beam, ccd, lambda: means(field, ccd))


def tilt(pixels: int, cells: int) -> Standard:
    """Reference scene: a flat in a Michelson, its reference tilted by 20 mrad: half a fringe per pixel."""
    angle, pitch = 20e-3, 8 * um
    flat = shapes.plate(2.0 * pixels * pitch, 2.0 * pixels * pitch)
    scene, beam, ccd = _michelson(flat, pixels * pitch, pixels, angle)
    arm = 0.5 * ccd.focus

    def truth() -> Truth:
        x, _ = pixel_centres((pixels, pixels), pitch)
        slope = math.sin(2.0 * angle)
        own = -0.5j * _turned(np.array(2.0 * arm))
        other = np.sinc(pitch * slope / WAVELENGTH) * reference(x, angle, arm)
        bright = 0.25 + 0.25 * math.cos(2.0 * angle) + 2.0 * (np.conj(own) * other).real
        return np.tile(own + other, (pixels, 1)), np.tile(bright, (pixels, 1))

    return Standard("steep tilt fringes", scene, beam, ccd, truth)


def step_standard(pixels: int, cells: int) -> Standard:
    """Reference scene: a step of 50 nm, 0.3 rad to the columns, in a Michelson."""
    width, edge, rise, turn = 6 * mm, 0.4 * mm, 50 * nm, 0.3
    mesh = shapes.step(4 * width, 4 * width, edge, rise).moved(turn=rotation((0, 0, 1), turn))
    scene, beam, ccd = _michelson(mesh, width, pixels, 0.0)
    arm = 0.5 * ccd.focus

    def truth() -> Truth:
        # the edge, x cos + y sin = edge, in pixels from the left side of each
        slope, left = -math.tan(turn), np.arange(pixels) - 0.5 * pixels
        at = edge / math.cos(turn) / ccd.pitch + slope * left[:, None] - left
        lower = (_covered(at + slope) - _covered(at)) / slope
        both = 1.0 + _turned(np.array(-2.0 * rise))
        field = -0.5j * _turned(np.array(2.0 * arm)) * (2.0 * lower + both * (1.0 - lower))
        return field, lower + (1.0 - lower) * 0.25 * abs(both) ** 2

    return Standard("slanted step", scene, beam, ccd, truth)


def _covered(u: FloatArray) -> FloatArray:
    """Integral up to u of the part of a pixel, 0 to 1, that is left of a line there."""
    return np.asarray(np.where(u < 0.0, 0.0, np.where(u < 1.0, 0.5 * u * u, u - 0.5)))


def valley(pixels: int, cells: int) -> Standard:
    """Reference scene: two mirrors tilted towards each other by 0.2 mrad, with fringes where they overlap."""
    height, start, angle, pitch = 2.0, 1.5, 0.2e-3, 4 * mm / pixels
    sides = np.array([-9 * mm, 0.0, 9 * mm])
    mesh = shapes.extrude(np.stack([sides, abs(sides) * math.tan(angle)], axis=1), 30 * mm)
    beam, ccd = _facing(start, 6 * mm, height, 4 * mm, pixels)

    def truth() -> Truth:
        x = (np.arange(pixels + 1) - 0.5 * pixels) * pitch
        rim, k = height * math.tan(2.0 * angle), wavenumber(WAVELENGTH) * math.sin(2.0 * angle)
        bright = math.cos(2.0 * angle)
        left, right, both = np.minimum(x, rim), np.maximum(x, -rim), np.clip(x, -rim, rim)
        waves = (np.exp(1j * k * left) - np.exp(-1j * k * right)) / (1j * k)
        total = left + right + np.sin(2.0 * k * both) / k
        way = _turned(np.array(start + height * math.cos(2.0 * angle)))
        field = -math.sqrt(bright) * way * np.diff(waves) / pitch
        return np.tile(field, (pixels, 1)), np.tile(bright * np.diff(total) / pitch, (pixels, 1))

    return Standard("valley of two mirrors", Scene((Surface(mesh, Mirror()),)), beam, ccd, truth)


def corner_cube_standard(pixels: int, cells: int) -> Standard:
    """Reference scene: a corner cube of 100 mm that returns a plane wave to a CCD tilted by 0.2 mrad."""
    size, side, lean = 100 * mm, 30 * mm, 0.2e-3
    axis = np.ones(3) / math.sqrt(3.0)
    across = np.array([1.0, -1.0, 0.0]) / math.sqrt(2.0)
    along = -axis * math.cos(0.05) + across * math.sin(0.05)
    start = -1.5 * size * along
    beam = Beam(start, along, UP, (1.4 * side, 1.4 * side), GRID)
    towards = rotation(across, lean) @ along
    # the apex sends a ray back as far on its other side
    ccd = CCD(-1.2 * size * along, towards, UP, side / pixels, (pixels, pixels))
    u, v, _ = ccd.axes

    def field(x: FloatArray, y: FloatArray) -> ComplexArray:
        # to the apex and back again: a plane wave that goes the other way
        path = -start @ along - (ccd.centre @ along + x * (u @ along) + y * (v @ along))
        return np.asarray(-math.sqrt(math.cos(lean)) * _turned(path))

    scene = Scene((Surface(shapes.corner_cube(size), Mirror()),))
    return Standard("corner cube", scene, beam, ccd, lambda: means(field, ccd))


STANDARDS: dict[str, Callable[[int, int], Standard]] = {
    "paraboloid": paraboloid,
    "sphere": sphere,
    "newton": newton_rings,
    "tilt": tilt,
    "step": step_standard,
    "valley": valley,
    "corner_cube": corner_cube_standard,
}
