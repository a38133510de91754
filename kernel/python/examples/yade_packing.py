"""Spheres of YADE to a file and back, with all their bits. In a script of YADE, with the folders of this file and of nscdd in PYTHONPATH:

    import yade_packing
    yade_packing.save("packing.vtkhdf")       # .csv goes too; python3 -m nscdd.exchange makes a packing of nscdd of either
    yade_packing.restore("packing.vtkhdf")    # adds the spheres of the file, and returns their numbers
"""
import nscdd
import numpy as np
from yade import FrictMat, Matrix3, O, Sphere, utils


def save(path):
    bodies = [body for body in O.bodies if isinstance(body.shape, Sphere)]
    if any(body.isClumpMember for body in bodies):
        raise ValueError("nscdd has no clumps")
    kinds = list(dict.fromkeys((body.material.id, body.material.label, body.material.density) for body in bodies))
    shape = np.array([[O.cell.hSize[row, column] for column in range(3)] for row in range(3)]) if O.periodic else None
    if O.periodic and np.tril(shape, -1).any():
        raise ValueError("the first edge of the cell must lie along x, the second in the plane of x and y")
    packing = nscdd.State(
        positions=np.array([body.state.pos for body in bodies]),
        radii=np.array([body.shape.radius for body in bodies]),
        box=shape.diagonal() if O.periodic else None,
        velocities=np.array([body.state.vel for body in bodies]),
        spins=np.array([body.state.angVel for body in bodies]),
        material=np.array([kinds.index((body.material.id, body.material.label, body.material.density)) for body in bodies]),
        materials=[label or f"material {number}" for number, label, _ in kinds],
        densities=np.array([density for _, _, density in kinds]),
        periodic="xyz" if O.periodic else "",
        tilt=np.triu(shape, 1) if O.periodic else None,
        fixed=np.array([not body.dynamic for body in bodies]),
        time=O.time,
    )
    if str(path).endswith(".csv"):
        nscdd.write_csv(path, packing)
    else:
        nscdd.write_vtkhdf(path, packing, h=O.dt)


def restore(path):
    packing = nscdd.read_csv(path) if str(path).endswith(".csv") else nscdd.read_vtkhdf(path)
    n = len(packing.radii)
    still = np.zeros((n, 3))
    if packing.periodic == "xyz":
        O.periodic = True
        shape = np.diag(packing.box) + (0 if packing.tilt is None else packing.tilt)
        O.cell.hSize = Matrix3(*shape.ravel().tolist())
    materials = [FrictMat() for _ in range(1 if packing.material is None else packing.material.max() + 1)]
    for name, values in (("label", packing.materials), ("density", packing.densities)):
        for material, value in zip(materials, [] if values is None else values):
            setattr(material, name, value)
    for material in materials:
        O.materials.append(material)
    numbers = []
    for k in range(n):
        kind = materials[0 if packing.material is None else packing.material[k]]
        body = utils.sphere(packing.positions[k].tolist(), float(packing.radii[k]), material=kind, fixed=bool(packing.fixed is not None and packing.fixed[k]))
        body.state.vel = (still if packing.velocities is None else packing.velocities)[k].tolist()
        body.state.angVel = (still if packing.spins is None else packing.spins)[k].tolist()
        numbers.append(O.bodies.append(body))
    return numbers
