"""Solves one FCLIB problem by a solver of Siconos, for comparison.

    PYTHONPATH=harness/suite python3 -m nscdd_suite.siconos_solve FILE --solver NSGS --tolerance 1e-6 --max-iterations 20000 -o SOLVED

Needs Siconos and SciPy (scripts/setup --siconos). Writes the problem in local form with the answer as /solution, which
`nscdd solve-fclib SOLVED --solver none` judges, and prints one line of JSON: iterations, CPU seconds of the solver's call
alone, and Siconos's own residual.
"""
import argparse
import json
import os
import tempfile
import time

os.environ |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # before NumPy: CPU time of one core
import h5py  # noqa: E402
import numpy as np  # noqa: E402
import scipy.sparse as sparse  # noqa: E402
import scipy.sparse.linalg as linear  # noqa: E402
import siconos.numerics as numerics  # noqa: E402

SOLVERS = ("NSGS", "NSN_AC", "ADMM")  # Gauss-Seidel, a semismooth Newton method, the alternating direction method of multipliers
GROUPS = ("fclib_local", "fclib_local_rolling", "fclib_global", "fclib_global_rolling")


def matrix(group):
    nz, rows, columns = (int(np.ravel(group[key][...])[0]) for key in ("nz", "m", "n"))
    p, i, x = (group[key][...] for key in ("p", "i", "x"))
    if nz < 0:
        return (sparse.csc_matrix if nz == -1 else sparse.csr_matrix)((x, i, p), shape=(rows, columns)).tocsc()
    i, p = i[:nz], p[:nz]
    if i.max(initial=0) >= rows or p.max(initial=0) >= columns:
        i, p = p, i
    return sparse.csc_matrix((x[:nz], (i, p)), shape=(rows, columns))


def read(path):
    """Components of a contact, W, q, mu, and mu_r, None without rolling resistance; global problems condensed."""
    with h5py.File(path) as file:
        name = next(name for name in GROUPS if name in file)
        group = file[name]
        size, mu = int(np.ravel(group["spacedim"][...])[0]), group["vectors/mu"][...]
        mu_r = group["vectors/mu_r"][...] if name.endswith("rolling") else None
        if "local" in name:
            return size, matrix(group["W"]), group["vectors/q"][...], mu, mu_r
        mass, h = linear.splu(matrix(group["M"])), matrix(group["H"])
        w = sparse.csc_matrix(h.T @ sparse.csc_matrix(mass.solve(h.toarray())))
        return size, w, group["vectors/w"][...] + h.T @ mass.solve(group["vectors/f"][...]), mu, mu_r


def write_problem(path, group, size, matrices, vectors, solution={}):
    """matrices: by columns."""
    values = {f"vectors/{name}": value for name, value in vectors.items()} | {"spacedim": integer(size)}
    for name, m in matrices.items():
        m.sort_indices()
        values |= {f"{name}/p": m.indptr.astype(np.int32), f"{name}/i": m.indices.astype(np.int32), f"{name}/x": m.data}
        values |= {f"{name}/{key}": integer(number) for key, number in (("nzmax", m.nnz), ("m", m.shape[0]), ("n", m.shape[1]), ("nz", -1))}
    with h5py.File(path, "w") as file:
        for key, value in ({f"{group}/{key}": value for key, value in values.items()} | {f"solution/{key}": value for key, value in solution.items()}).items():
            file[key] = value


def integer(number):
    return np.array([number], np.int32)


def write(path, size, w, q, mu, mu_r, r):
    rolls = {} if mu_r is None else {"mu_r": mu_r}
    write_problem(path, GROUPS[len(rolls)], size, {"W": w}, {"q": q, "mu": mu} | rolls, {"r": r, "u": w @ r + q})


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
    """Impulses r, and what main() prints."""
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
    began, wall = time.process_time(), time.monotonic()
    call(problem, r, u, settings)
    seconds, wall = time.process_time() - began, time.monotonic() - wall
    iterations, residual = int(settings.iparam[numerics.SICONOS_IPARAM_ITER_DONE]), float(settings.dparam[numerics.SICONOS_DPARAM_RESIDU])
    return r, {"iterations": iterations, "solver_cpu": seconds, "cores": seconds / wall, "residual": residual}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", help="FCLIB problem, local or global, with rolling resistance or without")
    parser.add_argument("--solver", choices=SOLVERS, default=SOLVERS[0], help="in 3D; in 2D, and with rolling resistance, there is NSGS")
    parser.add_argument("--tolerance", type=float, default=1e-6, help="on Siconos's own residual")
    parser.add_argument("--max-iterations", type=int, default=20000, help="cap")
    parser.add_argument("--repeat", type=int, default=1, help="of so many calls the one with the median CPU time counts")
    parser.add_argument("-o", "--output", required=True, help="HDF5 file to write")
    options = parser.parse_args()

    problem = read(options.file)
    calls = [solve(*problem, options.solver, options.tolerance, options.max_iterations) for _ in range(options.repeat)]
    r, report = sorted(calls, key=lambda call: call[1]["solver_cpu"])[options.repeat // 2]
    write(options.output, *problem, r)
    print(json.dumps(report))


if __name__ == "__main__":
    main()
