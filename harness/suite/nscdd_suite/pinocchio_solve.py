"""Solves one FCLIB problem in 3D, without rolling resistance, by Pinocchio's alternating direction method of multipliers, for comparison.

    PYTHONPATH=harness/suite python3 -m nscdd_suite.pinocchio_solve FILE --tolerance 1e-6 --max-iterations 20000 -o SOLVED

Needs Pinocchio from PyPI, beside Debian's NumPy and SciPy:

    /usr/bin/python3 -m venv --system-site-packages ENV && ENV/bin/pip install pin && ENV/bin/pip uninstall numpy
    NSCDD_PYTHON=ENV/bin/python scripts/suite run problems

The tolerance is absolute, on feasibility and complementarity. All other settings are Pinocchio's defaults; they solve Coulomb's law, not its convex form.
"""
from . import other_solver  # first: it holds the libraries to one core
import numpy as np
import pinocchio

DENSE = 30  # rows of W up to which its dense form is the faster


def constraints(mu):
    """Pinocchio's contacts. Of them its solver reads the cone alone, so all stand on one body of no use."""
    model = pinocchio.Model()
    body = model.addJoint(0, pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity(), "body")
    models, datas = pinocchio.StdVec_ConstraintModel(), pinocchio.StdVec_ConstraintData()
    for coefficient in mu:
        contact = pinocchio.PointContactConstraintModel(model, 0, pinocchio.SE3.Identity(), body, pinocchio.SE3.Identity())
        contact.setFriction(float(coefficient))
        models.append(pinocchio.ConstraintModel(contact))
        datas.append(models[len(models) - 1].createData())
    return models, datas


def solve(size, w, q, mu, mu_r, name, tolerance, max_iterations):
    """Impulses r, and what other_solver prints."""
    if size != 3 or mu_r is not None:
        raise SystemExit("pinocchio_solve: only problems in 3D, without rolling resistance")
    normal_last = np.arange(3 * len(mu)).reshape(-1, 3)[:, [1, 2, 0]].ravel()
    w = w[normal_last][:, normal_last]
    w = ((w + w.T) / 2).tocsc()
    w.sort_indices()
    settings, result = pinocchio.ADMMSolverSettings(), pinocchio.ADMMSolverResult()
    settings.absolute_feasibility_tol = settings.absolute_complementarity_tol = tolerance
    settings.relative_feasibility_tol = settings.relative_complementarity_tol = 0
    settings.max_iterations = max_iterations
    delassus = pinocchio.DelassusOperatorDense(w.toarray()) if len(q) <= DENSE else pinocchio.DelassusOperatorSparse(w)
    solver = pinocchio.ADMMConstraintSolver(len(q))
    contacts = constraints(mu)
    _, times = other_solver.timed(lambda: solver.solve(delassus, q[normal_last], *contacts, settings, result))
    r = np.empty(len(q))
    r[normal_last] = result.retrieveConstraintImpulses()
    residual = max(result.primal_feasibility, result.dual_feasibility, result.complementarity)
    return r, {"iterations": result.iterations, "residual": residual} | times


if __name__ == "__main__":
    other_solver.main(__doc__, ("ADMM",), solve)
