"""
The error budget, beside the true error
=======================================

A hollow mirror of 1 m radius, its facets ever finer: what they cost is estimated from the mesh alone, and
measured against the hollow's exact form. It is a quarter with every halving of the facets.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import mm, nm

wavelength, width = 632.8 * nm, 8 * mm
hollow = ft.forms.Conic(
    (0, 0, 0), (0, 0, -1), 1.0, -1.0
)  # a paraboloid: vertex, axis, radius in metres, conic constant
cells = np.array([8, 16, 32, 64])
terms = {name: [] for name in ("facets", "pixels", "sampling", "hit", "true")}
for count in cells:
    along = np.linspace(-0.5, 0.5, count + 1) * width
    mesh = ft.shapes.height_map(-(along**2 + along[:, None] ** 2) / 2.0, width / count)
    fields = []
    for form in (None, hollow):
        sample = ft.Surface(mesh, ft.Mirror(), "hollow", form)
        bench = ft.instruments.michelson(sample, aperture=6 * mm, pixels=(64, 64), method="rays")
        fields.append(bench.field(wavelength))
        if form is None:
            budget = ft.budget(bench.trace(), wavelength, "rays")
    faceted, exact = fields
    rms = np.sqrt((abs(faceted - exact) ** 2).mean() / (abs(exact) ** 2).mean()) / (2 * np.pi)
    for name in ("facets", "pixels", "sampling", "hit"):
        terms[name].append(getattr(budget, name))
    terms["true"].append(rms)
    print(f"{count:2d} cells a side: facets cost {budget.facets:.1e} waves by the budget, {rms:.1e} in truth")
print(budget)

ax = Figure(figsize=(8, 5), layout="constrained").subplots()
ax.loglog(
    cells, terms["true"], "o", color="black", markersize=9, markerfacecolor="none", label="facets, true error"
)
for (name, values), style in zip(terms.items(), ("-", "--", "-.", ":"), strict=False):
    colour = dict(facets="#D55E00", pixels="#0072B2", sampling="#009E73", hit="#999999")[name]
    ax.loglog(cells, values, style, marker=".", color=colour, label=f"{name}, estimated")
ax.set(xlabel="cells along a side of the mesh", ylabel="error / waves, rms")
ax.set_xticks(cells, cells)
ax.minorticks_off()
ax.legend(loc="center left", bbox_to_anchor=(1, 0.5))
ft.views.save(ax, "14_budget.png")
