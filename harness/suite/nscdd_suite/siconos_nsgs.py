"""Solves one FCLIB problem by the NSGS of Siconos, for comparison.

    PYTHONPATH=harness/suite python3 -m nscdd_suite.siconos_nsgs FILE --tolerance 1e-6 --max-iterations 20000 -o SOLVED

Needs Siconos and SciPy (scripts/setup --siconos). Writes the problem in local form with the answer as /solution, which
`nscdd solve-fclib SOLVED --solver none` judges, and prints one line of JSON: iterations, CPU seconds of the solver's call
alone, and Siconos's own residual.
"""
import argparse
import json
import os
import time

os.environ |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # before NumPy: CPU time of one core
import h5py  # noqa: E402
import numpy as np  # noqa: E402
import scipy.sparse as sparse  # noqa: E402
import scipy.sparse.linalg as linear  # noqa: E402
import siconos.numerics as numerics  # noqa: E402


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
    """dim, W, q, mu; global problems condensed."""
    with h5py.File(path) as file:
        group = file["fclib_local" if "fclib_local" in file else "fclib_global"]
        dim, mu = int(np.ravel(group["spacedim"][...])[0]), group["vectors/mu"][...]
        if "fclib_local" in file:
            return dim, matrix(group["W"]), group["vectors/q"][...], mu
        mass, h = linear.splu(matrix(group["M"])), matrix(group["H"])
        w = sparse.csc_matrix(h.T @ sparse.csc_matrix(mass.solve(h.toarray())))
        return dim, w, group["vectors/w"][...] + h.T @ mass.solve(group["vectors/f"][...]), mu


def write(path, dim, w, q, mu, r):
    w.sort_indices()
    values = {"W/p": w.indptr.astype(np.int32), "W/i": w.indices.astype(np.int32), "W/x": w.data, "vectors/q": q, "vectors/mu": mu}
    numbers = {"spacedim": dim, "W/nzmax": w.nnz, "W/m": w.shape[0], "W/n": w.shape[1], "W/nz": -1}
    with h5py.File(path, "w") as file:
        for key, value in (values | {key: np.array([number], np.int32) for key, number in numbers.items()}).items():
            file[f"fclib_local/{key}"] = value
        file["solution/r"], file["solution/u"] = r, w @ r + q


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", help="FCLIB problem, local or global")
    parser.add_argument("--tolerance", type=float, default=1e-6, help="on Siconos's own residual")
    parser.add_argument("--max-iterations", type=int, default=20000, help="cap")
    parser.add_argument("-o", "--output", required=True, help="HDF5 file to write")
    options = parser.parse_args()

    dim, w, q, mu = read(options.file)
    wide = w.copy()  # Siconos takes 64-bit indices
    wide.sort_indices()
    wide.indices, wide.indptr = wide.indices.astype(np.int64), wide.indptr.astype(np.int64)
    _, blocks = numerics.SBM_from_csparse(dim, wide)
    problem = numerics.FrictionContactProblem(dim, len(mu), blocks, q, mu)
    settings = numerics.solver_options_create(getattr(numerics, f"SICONOS_FRICTION_{dim}D_NSGS"))
    settings.dparam[numerics.SICONOS_DPARAM_TOL] = options.tolerance
    settings.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = options.max_iterations
    solve = numerics.fc3d_driver if dim == 3 else numerics.fc2d_driver
    r, u = np.zeros(len(q)), np.zeros(len(q))
    began, wall = time.process_time(), time.monotonic()
    solve(problem, r, u, settings)
    seconds, wall = time.process_time() - began, time.monotonic() - wall
    write(options.output, dim, w, q, mu, r)
    iterations, residual = int(settings.iparam[numerics.SICONOS_IPARAM_ITER_DONE]), float(settings.dparam[numerics.SICONOS_DPARAM_RESIDU])
    print(json.dumps({"iterations": iterations, "solver_cpu": seconds, "cores": seconds / wall, "residual": residual}))


if __name__ == "__main__":
    main()
