"""Triaxial compression, as Fig. 4 of the paper: the top comes down, pressure holds the sides. triaxial.py PACKING [STEPS]"""
import sys

import nscdd

packing = nscdd.read_packing(sys.argv[1])
steps = int(sys.argv[2]) if len(sys.argv) > 2 else 500
lateral = [nscdd.Wall(side=face, material="plate", pressure=1.0) for face in ("x-", "x+", "y-", "y+")]
sim = nscdd.Simulation(
    *(packing.positions, packing.radii),
    box=packing.box,
    materials={"grain": 1.0, "plate": 1.0},
    friction=0.3,
    pairs={("grain", "plate"): {"friction": 0.0}},
    walls=[nscdd.Wall(side="z-", material="plate"), nscdd.Wall(side="z+", material="plate", velocity=(0, 0, -0.01)), *lateral],
    h=0.02,
    subdomains=4,
)
for _ in range(5):
    report = sim.run(steps // 5)
    seen = sim.measures()
    strain, stress = 1 - seen["box"][2] / packing.box[2], seen["stress"]
    print(f"strain {strain:.4f}: axial {stress[2, 2]:.3f}, lateral {(stress[0, 0] + stress[1, 1]) / 2:.3f}, {report.iterations} iterations")
