"""Writes one contact problem in the text format of Siconos as an FCLIB file.

    PYTHONPATH=harness/suite python3 -m nscdd_suite.siconos_problems FILE.dat -o FILE.hdf5

Needs Siconos and SciPy (scripts/setup --siconos). The tests of Siconos have some 60 such problems, from five codes, local and global, without rolling
resistance: https://github.com/siconos/siconos, numerics/src/FrictionContact/test/data. The study `problems` solves a folder of them.
"""
import argparse

import numpy as np
import scipy.sparse as sparse
import scipy.sparse.coo  # noqa: F401, by which Siconos makes matrices
import siconos.numerics as numerics

from .other_solver import write_problem


def matrix(found):
    """Of what the module for Python gives for a matrix: an array, blocks, or its own type."""
    if isinstance(found, numerics.NumericsMatrix):
        found = numerics.NM_csc(found)
    elif isinstance(found, numerics.SparseBlockStructuredMatrix):
        _, found = numerics.SBM_to_sparse(found)
    return sparse.csc_matrix(found)


def local(path):
    problem = numerics.frictionContact_new_from_filename(path)
    contacts = problem.numberOfContacts
    return "fclib_local", problem.dimension, {"W": matrix(problem.M)}, {"q": vector(problem.q), "mu": vector(problem.mu, contacts)}


def of_bodies(path):
    problem = numerics.globalFrictionContact_new_from_filename(path)
    contacts = problem.numberOfContacts
    vectors = {"f": vector(problem.q), "w": vector(problem.b), "mu": vector(problem.mu, contacts)}
    return "fclib_global", problem.dimension, {"M": matrix(problem.M), "H": matrix(problem.H)}, vectors


def vector(values, size=None):
    return np.ravel(values)[:size].astype(float)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", help="problem, local; global where its name has gfc")
    parser.add_argument("-o", "--output", required=True, help="HDF5 file to write")
    options = parser.parse_args()
    read = of_bodies if "gfc" in options.file.lower().rpartition("/")[2] else local
    write_problem(options.output, *read(options.file))


if __name__ == "__main__":
    main()
