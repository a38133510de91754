"""Solves one FCLIB problem by the NSGS of Siconos, for comparison.

    PYTHONPATH=harness/suite python3 -m nscdd_suite.siconos_nsgs FILE --tolerance 1e-6 --max-iterations 20000 -o SOLVED

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


def write(path, size, w, q, mu, mu_r, r):
    w.sort_indices()
    values = {"W/p": w.indptr.astype(np.int32), "W/i": w.indices.astype(np.int32), "W/x": w.data, "vectors/q": q, "vectors/mu": mu}
    numbers = {"spacedim": size, "W/nzmax": w.nnz, "W/m": w.shape[0], "W/n": w.shape[1], "W/nz": -1}
    if mu_r is not None:
        values["vectors/mu_r"] = mu_r
    with h5py.File(path, "w") as file:
        for key, value in (values | {key: np.array([number], np.int32) for key, number in numbers.items()}).items():
            file[f"{GROUPS[mu_r is not None]}/{key}"] = value
        file["solution/r"], file["solution/u"] = r, w @ r + q


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


def solve(size, w, q, mu, mu_r, tolerance, max_iterations):
    """Impulses r, and what main() prints."""
    if mu_r is None:
        problem = with_friction(size, w, q, mu)
        solver = getattr(numerics, f"SICONOS_FRICTION_{size}D_NSGS")
        call = numerics.fc3d_driver if size == 3 else numerics.fc2d_driver
    else:
        problem = with_rolling(size, w, q, mu, mu_r)
        solver = numerics.SICONOS_ROLLING_FRICTION_3D_NSGS if size == 5 else numerics.SICONOS_ROLLING_FRICTION_2D_NSGS
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
    parser.add_argument("--tolerance", type=float, default=1e-6, help="on Siconos's own residual")
    parser.add_argument("--max-iterations", type=int, default=20000, help="cap")
    parser.add_argument("-o", "--output", required=True, help="HDF5 file to write")
    options = parser.parse_args()

    problem = read(options.file)
    r, report = solve(*problem, options.tolerance, options.max_iterations)
    write(options.output, *problem, r)
    print(json.dumps(report))


if __name__ == "__main__":
    main()
