"""Made-up results, for tests of the page: no value here was ever counted, simulated or measured."""
from ...made_up import made_up


def rheology(**changed):
    """The JSON of homogeneous shear: two rates of disks, one also by DCS, and one of spheres, also by LAMMPS."""
    usual = {"grains": 9, "steps": 3, "normal_stress": 1.0, "mu": 0.3, "mu_error": 0.01, "mu_published": 0.31, "solid_fraction": 0.8, "fraction_error": 0.01}
    usual |= {"fraction_published": None, "iterations_a_step": 10.0, "unconverged_steps": 0, "command": "nscdd run FABRICATED"}
    points = (("disks", "nlgs", 1e-3), ("disks", "nlgs", 0.1), ("disks", "dcs", 1e-3), ("spheres", "nlgs", 1e-3))
    rows = [{"scene": scene, "solver": solver, "inertial_number": inertial, **usual} for scene, solver, inertial in points]
    by_lammps = {"solver": "lammps", "fraction_error": 0.0, "iterations_a_step": None, "unconverged_steps": None, "command": "lmp FABRICATED"}
    rows.append(rows[-1] | by_lammps | {"motion_over_normal_stress": 0.01})
    return made_up("rheology", rows=rows, sources={}) | changed
