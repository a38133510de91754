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
    dof, frames = dim + spins, dim if tangential else 1
    driven = [w for w, mass in enumerate(wall_masses) if mass > 0]
    carrying = [c for c in range(len(state.i)) if state.impulse[c] @ state.normal[c] > 0]
    directions = np.zeros((len(grain_masses) * dof + len(driven), len(carrying) * frames))
    impulses = np.zeros(directions.shape[1])
    for column, c in enumerate(carrying):
        normal, wall = state.normal[c], -1 - state.j[c]
        frame, _ = np.linalg.qr(np.column_stack([normal, np.eye(dim)]))
        for k, direction in enumerate([normal, *frame.T[1:frames]]):
            at = column * frames + k
            impulses[at] = state.impulse[c] @ direction
            for body, sign in ((state.i[c], 1.0), (state.j[c], -1.0)):
                if body < 0:
                    continue
                directions[body * dof : body * dof + dim, at] += sign * direction
                if k:  # velocity at the contact: V - radius w x n for i, V + radius w x n for j
                    lever = -sign * state.radius[body] * normal
                    turn = lever[0] * direction[1] - lever[1] * direction[0] if dim == 2 else np.cross(lever, direction)
                    directions[body * dof + dim : (body + 1) * dof, at] += sign * turn
            if not k and wall in driven:
                directions[len(grain_masses) * dof + driven.index(wall), at] -= 1.0
    masses = np.column_stack([grain_masses] * dim + [inertias] * spins)
    return Network(directions, 1 / np.concatenate([masses.ravel(), [wall_masses[w] for w in driven]]), impulses)


def iteration_rate(masses, owners):
    """The factor by which an iteration of a supported chain shortens the error in the end: the spectral radius of one
    sweep of Gauss-Seidel, or, when `owners` (of contact k, below grain k) name several subdomains, of Alg. 1 with equal
    splitting. A column of N equal grains by one subdomain: cos^2(pi / 2N), hence 4/pi^2 N^2 sweeps per factor e."""
    n, owners = len(masses), np.asarray(owners)
    holds = {domain: np.isin(range(n), [k - far for k in np.flatnonzero(owners == domain) for far in (0, 1)]) for domain in set(owners)}
    multiplicity = sum(held.astype(int) for held in holds.values())
    inverse = multiplicity / np.asarray(masses)
    total = np.zeros((n, n))
    for domain, held in holds.items():
        v, own = np.eye(n), [k for k in np.flatnonzero(owners == domain) if k > 0]
        late = [k for k in own if multiplicity[k - 1 : k + 1].max() > 1]
        if owners[0] == domain:
            v[0] = 0
        for k in [k for k in own if k not in late] + late:  # the order of the sweep: walls, the inside, the interface
            change = (v[k] - v[k - 1]) / (inverse[k] + inverse[k - 1])
            v[k] -= inverse[k] * change
            v[k - 1] += inverse[k - 1] * change
        total += np.where(held[:, None], v, 0) / multiplicity[:, None]
    return float(np.abs(np.linalg.eigvals(total)).max())


def most_iterations(rate, tolerance, check_every):
    """Iterations from zero impulses until eta <= tolerance: eta <= 2 rate^k, as |e|_W starts at |r|_W <= sqrt(2) |r|_D
    and |D^-1 W e|_D <= sqrt(2) |e|_W; then the next test."""
    return math.ceil(math.log(2 / tolerance) / -math.log(rate)) + check_every
