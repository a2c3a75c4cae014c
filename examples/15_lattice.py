"""
Light among the rods of a lattice
=================================

Twenty by four mirror rods of 18 sides, lit at 20 degrees. Facets at multiples of 20 degrees send light to -20
degrees after odd numbers of reflections, and to 40 after even ones, up to multiples of 40 degrees.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import degree, nm, um

lattice = ft.scattering.RodLattice(columns=20, rows=4, radius=65 * nm, pitch=280 * nm)
turn = ft.vectors.rotation((0, 1, 0), 20 * degree)
beam = ft.Beam(turn @ [0, 0, 3 * um], turn @ [0, 0, -1], (0, 1, 0), (5.6 * um, 0.1 * um), (1, 2000))
paths = ft.trace(lattice.scene, beam, max_bounces=100, record=True)
met = paths.where(paths.bounces > 0)
angle = np.arctan2(met.direction[:, 0], met.direction[:, 2]) / degree

law = np.where(met.bounces % 2 == 1, -20, 20 + 20)
off = (angle - law + 20) % 40 - 20
print(f"{len(met)} of {len(paths)} rays meet rods, at most {met.bounces.max()} times")
print(f"directions off the law of angles: {abs(off).max():.1e} degrees at most")
print(f"power unaccounted for: {paths.ledger().error:.0e} of the incident")

figure = Figure(figsize=(14, 4.8), layout="constrained")
rods = figure.add_subplot(1, 3, (1, 2))
corner = 2 * np.pi * np.arange(18) / 18
prism = lattice.radius * np.stack([np.cos(corner), np.sin(corner)], axis=1)
for centre in lattice.centres:
    rods.fill(*(centre + prism).T / um, color="#606060")
classes = (
    ("1 reflection", 1, 1, "#0072B2"),
    ("2 reflections", 2, 2, "#E69F00"),
    ("3 and more", 3, 100, "#CC79A7"),
)
polar = figure.add_subplot(1, 3, 3, projection="polar")
below = np.zeros(18)
for name, least, most, colour in classes:
    chosen = np.flatnonzero((met.bounces >= least) & (met.bounces <= most))
    for row in chosen[:: max(1, len(chosen) // 8)]:
        way = np.array([*met.polyline(row), met.origin[row] + 1.5 * um * met.direction[row]])
        rods.plot(*way[:2].T[[0, 2]] / um, color="#BBBBBB", linewidth=0.8)
        rods.plot(*way[1:].T[[0, 2]] / um, color=colour, linewidth=0.8)
    counts = np.bincount(np.rint(angle[chosen] / 20).astype(int) % 18, minlength=18)
    polar.bar(np.arange(18) * 20 * degree, counts, 14 * degree, below, color=colour, label=name)
    below += counts
rods.set(xlabel="x / µm", ylabel="z / µm", xlim=(-3.4, 3.4), ylim=(-1.6, 2), title="some of the rays")
rods.set_aspect("equal")
polar.set_theta_zero_location("N")
polar.set_theta_direction(-1)
polar.set_rgrids((200, 400, 600, 800), angle=110)
polar.set_title("number of rays by direction,\nfrom z towards x")
rods.legend(*polar.get_legend_handles_labels(), loc="lower left", ncols=3)
ft.views.save(figure, "15_lattice.png")
