"""What the solvers of other codes have in common: FCLIB problems, read and written, and the command line.

The problem is written in local form with the answer as /solution, which `nscdd solve-fclib SOLVED --solver none` judges. One line of JSON is printed:
iterations, CPU seconds of the solver's call alone, the cores that it had, and the solver's own residual.
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


def timed(call):
    """What the call returns, and its times."""
    began, wall = time.process_time(), time.monotonic()
    found = call()
    seconds, wall = time.process_time() - began, time.monotonic() - wall
    return found, {"solver_cpu": seconds, "cores": seconds / wall}


def main(about, solvers, solve):
    """solve(*read(FILE), solver, tolerance, cap) -> impulses, and what is printed."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", help="FCLIB problem, local or global, with rolling resistance or without")
    parser.add_argument("--solver", choices=solvers, default=solvers[0])
    parser.add_argument("--tolerance", type=float, default=1e-6)
    parser.add_argument("--max-iterations", type=int, default=20000, help="cap")
    parser.add_argument("--repeat", type=int, default=1, help="of so many calls the one with the median CPU time counts")
    parser.add_argument("-o", "--output", required=True, help="HDF5 file to write")
    options = parser.parse_args()

    problem = read(options.file)
    calls = [solve(*problem, options.solver, options.tolerance, options.max_iterations) for _ in range(options.repeat)]
    r, report = sorted(calls, key=lambda call: call[1]["solver_cpu"])[options.repeat // 2]
    write(options.output, *problem, r)
    print(json.dumps(report))
