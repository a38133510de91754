"""Solves one FCLIB problem by a solver of Siconos, for comparison.

    PYTHONPATH=harness/suite python3 -m nscdd_suite.siconos_solve FILE --solver NSGS --tolerance 1e-6 --max-iterations 20000 -o SOLVED

Needs Siconos and SciPy (scripts/setup --siconos). The tolerance is on Siconos' own residual. There is NSGS alone in 2D, and with rolling resistance.
"""
import tempfile

from . import other_solver  # first: it holds the libraries to one core
import numpy as np
import siconos.numerics as numerics

SOLVERS = ("NSGS", "NSN_AC", "ADMM")  # Gauss-Seidel, a semismooth Newton method, the alternating direction method of multipliers


def with_friction(size, w, q, mu):
    wide = w.copy()  # Siconos takes 64-bit indices
    wide.sort_indices()
    wide.indices, wide.indptr = wide.indices.astype(np.int64), wide.indptr.astype(np.int64)
    _, blocks = numerics.SBM_from_csparse(size, wide)
    return numerics.FrictionContactProblem(size, len(mu), blocks, q, mu)


def with_rolling(size, w, q, mu, mu_r):
    """Through Siconos' text format, with a dense W by columns: its module for Python takes no array for mu_r."""
    with tempfile.NamedTemporaryFile("w", suffix=".dat") as file:
        file.write(f"{size}\n{len(mu)}\n0\n{w.shape[0]}\n{w.shape[1]}\n{w.shape[0]} {w.shape[1]}\n")
        for values in (w.toarray().ravel(order="F"), q, mu, mu_r):
            np.savetxt(file, values, fmt="%.17g")
        file.flush()
        return numerics.rollingFrictionContact_new_from_filename(file.name)


def solve(size, w, q, mu, mu_r, name, tolerance, max_iterations):
    """Impulses r, and what other_solver prints."""
    if mu_r is None:
        problem = with_friction(size, w, q, mu)
        solver = getattr(numerics, f"SICONOS_FRICTION_{size}D_{name}")
        call = numerics.fc3d_driver if size == 3 else numerics.fc2d_driver
    else:
        problem = with_rolling(size, w, q, mu, mu_r)
        solver = getattr(numerics, f"SICONOS_ROLLING_FRICTION_{3 if size == 5 else 2}D_{name}")
        call = numerics.rolling_fc3d_driver if size == 5 else numerics.rolling_fc2d_driver
    settings = numerics.solver_options_create(solver)
    settings.dparam[numerics.SICONOS_DPARAM_TOL] = tolerance
    settings.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = max_iterations
    if mu_r is not None:  # the default test of changes takes up to 50 times as many sweeps
        settings.iparam[numerics.SICONOS_FRICTION_3D_IPARAM_ERROR_EVALUATION] = numerics.SICONOS_FRICTION_3D_NSGS_ERROR_EVALUATION_FULL
    r, u = np.zeros(len(q)), np.zeros(len(q))
    _, times = other_solver.timed(lambda: call(problem, r, u, settings))
    iterations, residual = int(settings.iparam[numerics.SICONOS_IPARAM_ITER_DONE]), float(settings.dparam[numerics.SICONOS_DPARAM_RESIDU])
    return r, {"iterations": iterations, "residual": residual} | times


if __name__ == "__main__":
    other_solver.main(__doc__, SOLVERS, solve)
