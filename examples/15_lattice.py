"""Twenty by four rods of 65 nm, lit at 20 degrees: where the light goes, and after how many bounces."""

import numpy as np

import fringetrace as ft
from fringetrace import degree, nm, um

rods = ft.shapes.rod_lattice(20, 4, radius=65 * nm, pitch=280 * nm, length=2 * um)
low, high = rods.bounds
middle = 0.5 * (low + high)
scene = ft.Scene([ft.Surface(rods, ft.Mirror(), "rods")])
turn = ft.vectors.rotation((0, 1, 0), 20 * degree)
beam = ft.Beam(middle + turn @ [0, 0, 20 * um], turn @ [0, 0, -1], (0, 1, 0), (6 * um, 0.1 * um), (8, 2000))
paths = ft.trace(scene, beam, max_bounces=40)
bounces = np.bincount(paths.bounces)
for count, rays in enumerate(bounces):
    print(f"{count:3d} bounces: {rays:6d} rays")
met = paths.where(paths.bounces > 0)
angle = np.arctan2(met.direction[:, 0], met.direction[:, 2]) / degree
counts, edges = np.histogram(angle, bins=36, range=(-180, 180))
for begin, number in zip(edges, counts, strict=False):
    print(f"{begin:6.0f} to {begin + 10:4.0f} deg {'#' * (number // 100)}")
print("ledger:", paths.ledger())
