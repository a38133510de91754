"""A box of disks is shaken until the large one has come up, while a plot follows. brazil_nut.py PICTURE.png [SECONDS]"""
import math
import sys

import matplotlib.pyplot as plt
import nscdd
import numpy as np

longest = float(sys.argv[2]) if len(sys.argv) > 2 else 60.0
x, y = np.meshgrid(np.arange(0.55, 10, 1.1), np.arange(0.55, 14, 1.1))
apart = np.hypot(x - 5, y - 1.6) > 2.1  # of the nut
positions = np.vstack([[5, 1.6], np.column_stack([x[apart], y[apart]])])
radii = np.r_[1.5, np.random.default_rng(1).uniform(0.4, 0.5, apart.sum())]
walls = [nscdd.Wall((0, 1), (0, 0), velocity=(0, 0), name="floor"), nscdd.Wall((1, 0), (0, 0)), nscdd.Wall((-1, 0), (10, 0))]
sim = nscdd.Simulation(positions, radii, density=1.0, friction=0.4, walls=walls, gravity=(0, -9.81), h=2e-3)
omega, heights = 2 * np.pi * 1.5, []  # three shakes in two seconds, 5 g at most


def follow(sim, report):
    sim.walls["floor"].velocity = (0, 5 * 9.81 / omega * math.cos(omega * sim.time))
    heights.append(sim.positions[0, 1])
    if sim.steps % 500 == 0:
        plt.plot(sim.h * np.arange(len(heights)), heights, "C0")
        plt.pause(1e-3) if plt.get_backend() != "agg" else plt.savefig(sys.argv[1])
    return sim.time > longest or heights[-1] > np.median(sim.positions[:, 1])


sim.run(10**6, follow)
plt.savefig(sys.argv[1])
print(f"after {sim.time:.2f} s the nut is at {heights[-1]:.2f}, the median grain at {np.median(sim.positions[:, 1]):.2f}")
