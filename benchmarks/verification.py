"""What the physics tests compare with what, and how far off they were: measured while the tests run.

python benchmarks/verification.py           print the table
python benchmarks/verification.py --write   and write it into docs/verification.md

No error is typed in. A plugin listens to the comparisons of each test (`assert a < b`, `pytest.approx`,
`numpy.testing.assert_allclose`) and keeps the one that came nearest to its tolerance.
"""

from __future__ import annotations

import ast
import math
import re
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any
from unittest import mock

import numpy as np
import pages
import pytest

# pytest compares arrays and sequences number by number too
Scalar = type(pytest.approx(1.0))
TESTS = Path(__file__).parents[1] / "tests" / "physics"

# Section, then: system | truth | room of tests::test | unit | part of the statement, where a test makes several
ROWS = """
## Interferometers
Michelson, tilted mirror: optical path | plane wave, 50 digits | michelson::the_path_off_a_tilted_mirror_is_that_of_the_plane_wave | waves |
Michelson, tilted mirror: fringe period | wavelength / sin 2a, printed | michelson::fringes_are_as_far_apart_as_the_turned_wave_says | |
Michelson, steps of 50 to 158.2 nm | irradiance, printed to 9 digits | michelson::a_step_has_the_irradiance_of_its_phase | of the beam's | edge + 1
Michelson, moved mirror | cos² | michelson::a_piston_scan_is_a_squared_cosine | of the beam's |
Michelson, both ports | sum 1 | michelson::what_one_port_lacks_goes_out_of_the_other | of the beam's |
Michelson, fringes narrower than pixels: visibility | sinc | michelson::a_pixel_that_averages_irradiance_sees_the_sinc | |
Michelson, relief: height map back from four frames | the height map | michelson::a_height_map_comes_back | m, rms |
Michelson, tilted mirror out of focus: retrace error | h (1 - s²) | michelson::a_slope_above_the_focus_has_the_retrace_error | waves | HENE
Michelson, a line of 10 nm: visibility | Gaussian coherence | coherence::a_line_of_ten_nanometres | of 1 | visibility
Michelson, sodium lines: visibility over the beat | \|cos\| | coherence::the_beat_of_the_sodium_lines | of 1 | visibility
Michelson, plates of glass: path | 2d (√(n² - 1/2) - √(1/2)) | coherence::a_splitter_of_glass_adds_two_crossings_that_a_compensator_takes_away | |
Mach-Zehnder, tilted slab: path | Snell, printed to 9 digits of 1 um | mach_zehnder::a_tilted_slab | um | reference
Mach-Zehnder, slab: phase by phase steps | printed to 9 digits | mach_zehnder::the_recorded_phase_is_that_of_the_slab | m | path_difference
Mach-Zehnder, cylinder and ball refocused: path | printed to 9 digits of 1 um | mach_zehnder::a_refocused_cylinder_and_a_ball | um | length
Mach-Zehnder, cylinder of 50 um, NA 0.8: phase | Maxwell's equations (cylindrical harmonics) | mach_zehnder::rays_are_within_five_milliradians_of_the_waves | rad | angle
Fizeau, two plates of glass | Airy's sum, printed to 9 digits | fizeau::a_gap_between_two_glass_plates | of the beam's |
Fizeau, wedge: fringe period | wavelength / 2n tan a, printed | fizeau::the_fringes_of_a_wedge | |
Fizeau, lens on a flat: Newton's rings | r² = mλR - (mλ/2)² | fizeau::newtons_rings | |
Jamin-Lebedeff, analyser | cos² and sin² of half the delay | jamin_lebedeff_bench::the_analyser_shows_cosine_and_sine_of_half_the_delay | of the beam's |
Jamin-Lebedeff, Cauchy's A and B of chitin, measured | as put in | jamin_lebedeff_bench::the_indices_of_chitin_come_back | |
Twyman-Green, sphere of 0.5 m and a tilted flat | closed form a pixel | curved_mirrors::a_sphere_in_a_michelson_makes_rings | of the beam's |
Newton's rings, full field: irradiance | both rays in closed form | newton::the_image_is_that_of_both_rays | of the beam's, rms | sqrt
Phase stepping with wrong steps: error of seven algorithms | closed forms | phase_stepping::wrong_steps | rad |
Two wavelengths: stairs | the heights put in | synthetic_wavelength::heights_without_noise | m |

## Mirrors, facets, forms
Corner cube: path | twice the depth, by symmetry | mirrors::a_corner_cube | |
1,000 bounces between plates | unfolded path | mirrors::a_thousand_bounces_between_parallel_plates | |
Wedge of two mirrors | unfolding | mirrors::a_wedge_of_two_mirrors | |
Parabola: paths to the focus | equal | exact_forms::a_parabola_has_equal_paths_to_its_focus | focal lengths, of 2.5 | path - 2.5
Ellipsoid: paths between foci, bounce after bounce | 2a each | exact_forms::an_ellipsoid_sends_light_from_focus_to_focus_again_and_again | of a |
Spherical mirror: aberration | printed digits | exact_forms::aberration_of_a_spherical_mirror | | length
Two discs, ray by ray: paths | printed, to 50 digits | exact_forms::two_discs_scatter_as_printed | radii | length
Asphere: path | mpmath | exact_forms::an_asphere_where_mpmath_finds_it | |
Facets of an icosphere: sag | closed form | sag::sag_of_an_icosphere | |
Patches over a sphere's vertices | fourth power of the spacing | smooth_forms::patches_come_nearer_to_a_sphere_as_the_fourth_power | |

## From rays to light
Paraboloid: spherical wave before and behind the focus | closed form | wavefronts::a_paraboloid_makes_a_spherical_wave_before_and_beyond_its_focus | |
Tilt fringes on pixels of any size | sinc, tabulated | wavefronts::tilt_fringes_are_averaged_over_the_pixel | of the beam's |
Slanted step: pixels on the edge | cos² mixed by area | wavefronts::pixels_on_a_slanted_step_see_both_its_sides | of the beam's |
Beyond a caustic: one ray or three | the sum of the rays | wavefronts::rays_beyond_a_caustic_add_to_the_wave | |
Across a fold of a cylinder | Kirchhoff's integral | caustics::the_field_across_a_fold | of the peak |
Groove or ridge narrower than a cell | mixed by area | features::a_groove_or_ridge_in_a_michelson_darkens_its_area | of the beam's |
Wire before a curved mirror | shadow in closed form | features::a_wire_before_a_curved_mirror_casts_its_shadow | |
Half plane before a curved mirror | shadow in closed form | curved_mirrors::a_half_plane_shadows_part_of_a_curved_mirror | |

## Matter and films
Snell and Fresnel, air to glass, traced | printed to 9 digits | refraction::air_to_glass | |
Total reflection: phase | printed | refraction::total_reflection_and_its_phase | |
Fresnel's rhomb | circular light | refraction::fresnel_rhomb | |
Gold mirror | printed reflectances | refraction::gold_mirror | |
Prism: least deviation | closed form, printed | refraction::minimum_deviation_of_a_prism | |
Corner cube of glass: polarisation | Peck's Jones matrices | refraction::total_reflections_in_a_corner_cube | |
Fresnel rays against Stokes' relations | r12 = -r21, t12 t21 - r12 r21 = 1 | refraction::stokes_relations | |
Tilted slab: fringes of equal inclination | Airy's sum | light_through_glass::fringes_of_equal_inclination | |
Gap of air between glass, plane | Airy's sum | gaps::a_plane_gap_between_glass | |
Soap film, traced as two faces | Airy's sum, printed | traced_films::soap_film | |
Quarter-wave mirror, by bounces | transfer matrix | traced_films::quarter_wave_mirror_by_bounces | |
Absorbing layers, by bounces | transfer matrix | traced_films::absorbing_layers_by_bounces | |
Any stack of films | the program tmm | thin_films::beside_tmm | |
Scales of Morpho | printed reflectances | thin_films::morpho | |

## Lenses and thin elements
Plano-convex, biconvex and ball: focal lengths | mpmath, printed to 10 digits | lens_rays::traced_focal_lengths_to_the_printed_digits | |
Singlet and doublet: paths and places | the program optiland | lens_rays::singlet_and_doublet_agree_with_optiland | m |
Triplet of aspheres, skew rays: paths | mpmath | lens_rays::aspheres_of_three_glasses_as_mpmath_has_them | |
Plano-hyperbola: paths to the focus | equal | lens_rays::a_plano_hyperbola_has_equal_paths_to_its_focus | m |
Ideal lens: paths from point to image | equal, mpmath | thin_lenses::every_ray_of_an_object_point_has_the_same_path_to_its_image | |
Grating orders: angles, 600 lines/mm at 35° | grating equation | grating_orders::six_hundred_lines_to_the_millimetre_at_35_degrees | |
Thin phase gratings: efficiencies | Bessel functions, sinc² | grating_orders::efficiencies_of_thin_phase_gratings | |
Calcite plate at 45°: walk-off | closed form, printed | shear_plates::calcite_at_45_degrees | |
Wollaston prisms | two refractions | shear_plates::wollaston_prisms_by_two_refractions | |
Senarmont's compensator | dark at half the delay | jamin_lebedeff::senarmont | |

## Power
Splitters, both ports | what came in | energy::the_two_ports_of_a_michelson_add_up_to_what_came_in | |
Cavity: transmitted and reflected | Airy | energy::the_partial_waves_of_a_cavity_add_up_to_airy | |
Lossy cavity | geometric series | energy::the_powers_of_a_lossy_cavity_are_geometric_series | |

## Structural colour
Finite mirror: BRDF | sinc² lobe, grating of N rays | brdf::a_mirror_of_finite_size_has_the_lobe_of_a_slit | |
V-grooves of 90°: orders sent back | closed form | brdf::grooves_send_light_back | |
Lambertian dome of facets | ρ/π | brdf::a_dome_that_scatters_as_lambert_said | |
Two discs: coherent sum | geometrical optics, printed | brdf::two_discs | | wave -
The 2013 study's Michelson, ray by ray | an independent exact tracer | study::michelson_ray_by_ray | |
The 2013 study's lattice, 49 spectra | an independent exact tracer | study::the_study_s_spectra | |
Melanin rods in keratin: reflectance | the program treams | rods_of_matter::feathers | |
20 × 4 rods: backscatter | long multipole series | rods_of_matter::backscatter_of_twenty_by_four_melanin_rods | |
White points of CIE lamps | CIE tables | colour::white_points | in x, y |
Newton's scale of colours | a published program's XYZ | colour::newtons_scale_of_colours | of Y = 100 |
"""


@dataclass(frozen=True)
class Reading:
    """One comparison that held: how far off, how much was allowed, whether relative, the statement."""

    error: float
    allowed: float
    relative: bool
    statement: str


@cache
def statements(path: str) -> list[tuple[int, int, str]]:
    """First line, last line and text of each simple statement of a file."""
    text = Path(path).read_text(encoding="utf-8")
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Assert | ast.Expr)]
    return [(node.lineno, node.end_lineno or node.lineno, ast.unparse(node)) for node in nodes]


def statement(path: str, line: int) -> str:
    """The statement of a file that a line belongs to."""
    return next((text for first, last, text in statements(path) if first <= line <= last), "")


def asking() -> tuple[str, int]:
    """File and line of the test that is asking."""
    frame: FrameType | None = sys._getframe(1)
    while frame and TESTS not in Path(frame.f_code.co_filename).parents:
        frame = frame.f_back
    return (frame.f_code.co_filename, frame.f_lineno) if frame else ("", 0)


class Meter:
    """A pytest plugin: readings by test."""

    def __init__(self) -> None:
        self.readings: dict[str, list[Reading]] = defaultdict(list)
        self.test = ""

    def keep(self, error: float, allowed: float, relative: bool, where: tuple[str, int]) -> None:
        """Keep what held."""
        if self.test and 0.0 <= error <= allowed < math.inf:
            self.readings[self.test].append(
                Reading(float(error), float(allowed), relative, statement(*where) if where[1] else "")
            )

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        """Listen while a test runs."""
        self.test = f"{item.path.stem}::{getattr(item, 'originalname', item.name)}"
        with self.listening():
            result = yield
        self.test = ""
        return result

    def pytest_assertion_pass(self, item: pytest.Item, lineno: int, orig: str, expl: str) -> None:
        """`assert error < allowed` of two numbers."""
        sides = re.fullmatch(r"(.+?) <=? (.+)", expl.partition("\n")[0])
        if sides:
            try:
                error, allowed = (float(eval(side, {"np": np})) for side in sides.groups())
            except (SyntaxError, NameError, TypeError, ValueError, AttributeError):
                return
            self.keep(error, allowed, False, (str(item.path), lineno))

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Hear each number that pytest.approx and assert_allclose compare."""
        equal, close = Scalar.__eq__, np.testing.assert_allclose

        def heard(approx: Any, actual: Any) -> bool:
            same = equal(approx, actual)
            if same and np.ndim(actual) == 0 and isinstance(approx.expected, int | float | complex):
                relative = approx.abs is None and approx.expected != 0
                scale = abs(approx.expected) if relative else 1.0
                self.keep(abs(actual - approx.expected) / scale, approx.tolerance / scale, relative, asking())
            return same

        def checked(actual: Any, desired: Any, rtol: float = 1e-7, atol: float = 0.0, **options: Any) -> None:
            close(actual, desired, rtol, atol, **options)
            off, size = abs(np.asarray(actual) - desired), abs(np.asarray(desired))
            off, size = np.broadcast_arrays(np.nan_to_num(off), size)
            allowed = atol + rtol * size
            worst = (np.unravel_index((off / np.where(allowed > 0, allowed, 1)).argmax(), off.shape)) if off.size else ()
            if off.size:
                relative = np.all(atol == 0)
                scale = (size[worst] or 1.0) if relative else 1.0
                self.keep(off[worst] / scale, np.broadcast_to(allowed, off.shape)[worst] / scale, bool(relative), asking())

        with mock.patch.object(Scalar, "__eq__", heard), mock.patch.object(np.testing, "assert_allclose", checked):
            yield


def measure(names: list[str]) -> dict[str, list[Reading]]:
    """Run tests, and return what they read."""
    meter = Meter()
    with tempfile.TemporaryDirectory() as folder:
        sys.pycache_prefix = folder  # tests compiled before have no hook
        options = ["-q", "-p", "no:cacheprovider", "-o", "enable_assertion_pass_hook=true"]
        code = pytest.main([*options, *names], plugins=[meter])
    if code != 0:
        raise SystemExit(f"Tests: expected all to pass, got exit code {code}")
    return meter.readings




def rows() -> Iterator[tuple[str, ...]]:
    """Headings (one cell) and rows (five cells) of the table."""
    for line in ROWS.strip().splitlines():
        if line.strip():
            yield (line,) if line.startswith("#") else tuple(x.strip() for x in re.split(r"(?<!\\)\|", line))


def names() -> list[str]:
    """The tests of the table, as pytest takes them."""
    found = [row[2].split("::") for row in rows() if len(row) > 1]
    return [f"{TESTS}/test_{room}.py::test_{test}" for room, test in found]


if __name__ == "__main__":
    import json
    files = sorted({n.split("::")[0] for n in names()})
    out = Path(sys.argv[1])
    found = {}
    r = measure(names())
    out.write_text(json.dumps({k: [[x.error, x.allowed, x.relative, x.statement] for x in v] for k, v in r.items()}))
