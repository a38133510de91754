"""For test_exchange, run by YADE: `make FILE BITS periodic|open` makes a packing and saves it, `back FILE BITS` adds that of a file.

BITS.npz has places, radii, velocities, spins, densities and the cell of YADE's bodies, as YADE has them."""
import random
import sys

import numpy as np
import yade_packing


def make(path, periodic):
    random.seed(3)
    if periodic:
        O.periodic = True
        O.cell.hSize = Matrix3(1.1, 0.1, 0.07, 0, 1.2, 0.03, 0, 0, 1.3)
    for label, density in (("glass", 2500.1), ("steel", 7800.3)):
        O.materials.append(FrictMat(label=label, density=density, young=1e6))
    for k in range(60):
        radius = random.uniform(0.09, 0.11)
        ball = sphere([random.uniform(0, 1.1) for _ in range(3)], radius, material="glass" if k % 3 else "steel", fixed=k == 7)
        ball.state.vel = [random.gauss(0, 1) for _ in range(3)]
        ball.state.angVel = [random.gauss(0, 1) for _ in range(3)]
        O.bodies.append(ball)
    law = [Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys()], [Law2_ScGeom_FrictPhys_CundallStrack()]
    O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb()]), InteractionLoop(*law), NewtonIntegrator(gravity=(0, 0, -9.81))]
    O.dt = 1e-4
    O.run(200, True)  # they touch, so that no number is round
    yade_packing.save(path)


what, path, bits, *how = sys.argv[1:]
if what == "make":
    make(path, how == ["periodic"])
else:
    yade_packing.restore(path)
bodies = list(O.bodies)
np.savez(
    bits,
    positions=[body.state.pos for body in bodies],
    radii=[body.shape.radius for body in bodies],
    velocities=[body.state.vel for body in bodies],
    spins=[body.state.angVel for body in bodies],
    densities=[body.material.density for body in bodies],
    dynamic=[body.dynamic for body in bodies],
    cell=[[O.cell.hSize[row, column] for column in range(3)] for row in range(3)] if O.periodic else [],
)
