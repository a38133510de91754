"""What linear algebra says of a network of contacts: how far an answer of residual eta may be from the exact one, and
how many sweeps it takes."""
import math

import numpy as np


class Network:
    """W = H^T M^-1 H of contacts that all carry. Columns of H are contact directions, rows degrees of freedom.

    One exact solve of each contact alone changes r by -D^-1 W e, with e the error of r and D the diagonal of W. Hence
    eta = |D^-1 W e|_D / |r|_D, and with the smallest eigenvalue of D^-1/2 W D^-1/2, `least`,
        |e|_D <= eta |r|_D / least            impulses
        |V - V*|_M = |e|_W <= eta |r|_D / sqrt(least)   velocities.
    Where impulses are not unique (W singular) the second holds with the smallest eigenvalue that is not zero.
    """

    def __init__(self, directions, inverse_masses, impulses=None):
        self.impulses = impulses  # as found, if of a state
        w = directions.T @ (inverse_masses[:, None] * directions)
        self.diagonal = np.diag(w).copy()
        scale = 1 / np.sqrt(self.diagonal)
        eigenvalues = np.linalg.eigvalsh(scale[:, None] * w * scale)
        self.least = eigenvalues[eigenvalues > 1e-10 * eigenvalues[-1]][0]

    def norm(self, impulses):
        return math.sqrt(float(np.sum(self.diagonal * np.square(impulses))))

    def impulse_bound(self, eta):
        """On |e|_D over |r|_D."""
        return eta / self.least

    def velocity_bound(self, eta, impulses):
        """On |V - V*|_M."""
        return eta * self.norm(impulses) / math.sqrt(self.least)


def chain(masses, supported):
    """Grains in a row, each touching the next; the first also a wall if `supported`."""
    n = len(masses)
    between = np.eye(n)[:, 1:] - np.eye(n)[:, :-1]
    directions = np.hstack([np.eye(n)[:, :1], between]) if supported else between
    return Network(directions, 1 / np.asarray(masses))


def of_state(state, grain_masses, inertias, wall_masses, tangential):
    """All contacts of a state that carry, as if they stuck (or, not tangential, slid without friction)."""
    dim = state.x.shape[1]
    spins = 0 if not tangential else 1 if dim == 2 else 3
    dof = dim + spins
    n = len(grain_masses)
    driven = [w for w, mass in enumerate(wall_masses) if mass > 0]
    carrying = [c for c in range(len(state.i)) if state.impulse[c] @ state.normal[c] > 0]
    frames = 1 if not tangential else dim
    directions = np.zeros((n * dof + len(driven), len(carrying) * frames))
    impulses = np.zeros(directions.shape[1])
    for column, c in enumerate(carrying):
        i, j, normal = state.i[c], state.j[c], state.normal[c]
        basis = [normal]
        if tangential:
            full, _ = np.linalg.qr(np.column_stack([normal, np.eye(dim)]))
            basis += [full[:, k] for k in range(1, dim)]
        for k, direction in enumerate(basis):
            at = column * frames + k
            impulses[at] = state.impulse[c] @ direction
            for body, sign in ((i, 1.0), (j, -1.0)):
                if body < 0:
                    continue
                directions[body * dof : body * dof + dim, at] += sign * direction
                if k:  # velocity at the contact: V - radius w x n for i, V + radius w x n for j
                    lever = -sign * state.radius[body] * normal
                    turn = [lever[0] * direction[1] - lever[1] * direction[0]] if dim == 2 else np.cross(lever, direction)
                    directions[body * dof + dim : (body + 1) * dof, at] += sign * np.asarray(turn)
            if not k and j < 0 and -1 - j in driven:
                directions[n * dof + driven.index(-1 - j), at] -= 1.0
    inverse = np.concatenate(
        [
            np.column_stack([np.repeat(1 / grain_masses[:, None], dim, 1), np.repeat(1 / inertias[:, None], spins, 1)]).ravel(),
            [1 / wall_masses[w] for w in driven],
        ]
    )
    return Network(directions, inverse, impulses)


def iteration_rate(masses, owners):
    """The factor by which an iteration of a supported chain shortens the error in the end: the spectral radius of one
    sweep of Gauss-Seidel, or, when `owners` (of contact k, below grain k) name several subdomains, of Alg. 1 with equal
    splitting. A column of N equal grains by one subdomain: cos^2(pi / 2N), hence 4/pi^2 N^2 sweeps per factor e."""
    n = len(masses)
    domains = sorted(set(owners))
    holds = np.zeros((len(domains), n), bool)
    for k, owner in enumerate(owners):
        holds[domains.index(owner), max(0, k - 1) : k + 1] = True
    multiplicity = holds.sum(0)
    inverse = multiplicity / np.asarray(masses)
    total = np.zeros((n, n))
    for s, domain in enumerate(domains):
        v = np.eye(n)
        late = [k for k in range(1, n) if owners[k] == domain and multiplicity[k - 1 : k + 1].max() > 1]
        early = [k for k in range(1, n) if owners[k] == domain and k not in set(late)]
        if owners[0] == domain:
            v[0] = 0
        for k in early + late:  # the order of the sweep: walls, the inside, the interface
            change = (v[k] - v[k - 1]) / (inverse[k] + inverse[k - 1])
            v[k] -= inverse[k] * change
            v[k - 1] += inverse[k - 1] * change
        total += np.where(holds[s][:, None], v, 0) / multiplicity[:, None]
    return float(np.abs(np.linalg.eigvals(total)).max())


def most_iterations(rate, tolerance, check_every):
    """Iterations from zero impulses until eta <= tolerance: eta <= 2 rate^k, as |e|_W starts at |r|_W <= sqrt(2) |r|_D
    and |D^-1 W e|_D <= sqrt(2) |e|_W; then the next test."""
    return math.ceil(math.log(2 / tolerance) / -math.log(rate)) + check_every
