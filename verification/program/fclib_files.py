"""Contact problems as FCLIB files: written as other codes write them, and judged, with h5py and NumPy alone."""
import h5py
import numpy as np


def compressed(a):
    """Pointers, indices and values of the rows of a dense matrix; those of its columns from a.T."""
    rows = [np.flatnonzero(row) for row in a]
    return np.cumsum([0] + [len(row) for row in rows]), np.concatenate(rows), np.concatenate([row[k] for row, k in zip(a, rows)])


def write_matrix(file, group, a, kind):
    """kind: columns, rows, triplets (i = row), or triplets as fclib.h has them (p = row); with spare room after the last entry."""
    if kind == "columns":
        nz, (p, i, x) = -1, compressed(a.T)
    elif kind == "rows":
        nz, (p, i, x) = -2, compressed(a)
    else:
        i, p = np.nonzero(a)
        nz, x = len(i), a[i, p]
        if kind == "header":
            i, p = p, i
    scalars = {"m": a.shape[0], "n": a.shape[1], "nz": nz, "nzmax": len(x) + int(kind == "rows")}
    for name, value in scalars.items():
        file[f"{group}/{name}"] = np.array([value], np.int32)
    spare = np.zeros(int(kind == "rows"))
    file[f"{group}/p"] = p.astype(np.int32)
    file[f"{group}/i"] = np.concatenate([i, spare]).astype(np.int32)
    file[f"{group}/x"] = np.concatenate([x, spare])


def write_problem(path, group, matrices, vectors, kind, mu_r):
    """With mu_r a problem with rolling resistance; the first vector has the components of all contacts."""
    group += "" if mu_r is None else "_rolling"
    vectors |= {} if mu_r is None else {"mu_r": mu_r}
    with h5py.File(path, "w") as file:
        file[f"{group}/spacedim"] = np.array([len(next(iter(vectors.values()))) // len(vectors["mu"])], np.int32)
        for name, matrix in matrices.items():
            write_matrix(file, f"{group}/{name}", matrix, kind)
        for name, values in vectors.items():
            file[f"{group}/vectors/{name}"] = values
    return path


def write_local(path, w, q, mu, kind="columns", mu_r=None):
    return write_problem(path, "fclib_local", {"W": w}, {"q": q, "mu": mu}, kind, mu_r)


def write_global(path, m, h, f, w, mu, kind="triplets", mu_r=None):
    return write_problem(path, "fclib_global", {"M": m, "H": h}, {"w": w, "f": f, "mu": mu}, kind, mu_r)


def dense(group):
    """W of a file that keeps it by columns."""
    p, i, x = (group[name][...] for name in "pix")
    a = np.zeros((group["m"][0], group["n"][0]))
    for column in range(a.shape[1]):
        np.add.at(a[:, column], i[p[column] : p[column + 1]], x[p[column] : p[column + 1]])
    return a


def law_errors(w, q, mu, r):
    """Of each contact: Signorini as |min(s r_n, u_n)| with s = mean(diag W), Coulomb as |r_t - (the disk's point nearest to r_t - u_t/s)| s."""
    dim = len(q) // len(mu)
    u = (w @ r + q).reshape(-1, dim)
    r = r.reshape(-1, dim)
    s = np.diag(w).reshape(-1, dim).mean(1)
    signorini = np.abs(np.minimum(s * r[:, 0], u[:, 0]))
    pushed = r[:, 1:] - u[:, 1:] / s[:, None]
    length = np.linalg.norm(pushed, axis=1)
    limit = mu * np.maximum(r[:, 0], 0)
    pushed *= np.minimum(1, limit / np.maximum(length, 1e-300))[:, None]
    return np.maximum(signorini, s * np.linalg.norm(r[:, 1:] - pushed, axis=1)) / np.abs(q).max()


def rolling_parts(w, q, mu, r):
    """r and u = W r + q of each contact: normal, friction and slip, couple and spin."""
    size = len(q) // len(mu)
    part = (size - 1) // 2
    return [(v[:, 0], v[:, 1 : 1 + part], v[:, 1 + part :]) for v in (a.reshape(-1, size) for a in (r, w @ r + q))]


def rolling_natural_map(w, q, mu, mu_r, r):
    """|r - P(r - u - (mu |slip| + mu_r |spin|) n)| over the largest of |q|, |r| and |u|, as Siconos 4.4 has it.

    P is the nearest point of the cone |friction| <= mu n, |couple| <= mu_r n. Its n is the root of n - y_n - mu (|y_t| - mu n)^+ -
    mu_r (|y_c| - mu_r n)^+, which rises: found by halving.
    """
    (rn, rt, rc), (un, ut, uc) = rolling_parts(w, q, mu, r)
    length = lambda v: np.linalg.norm(v, axis=1)
    yn, yt, yc = rn - un - mu * length(ut) - mu_r * length(uc), rt - ut, rc - uc
    low, high = np.zeros(len(yn)), np.abs(yn) + mu * length(yt) + mu_r * length(yc)
    for _ in range(200):
        n = 0.5 * (low + high)
        beyond = n - yn - mu * np.maximum(length(yt) - mu * n, 0) - mu_r * np.maximum(length(yc) - mu_r * n, 0) > 0
        low, high = np.where(beyond, low, n), np.where(beyond, n, high)
    within = lambda y, limit: y * np.minimum(1, limit / np.maximum(length(y), 1e-300))[:, None]
    error = np.hstack([(rn - low)[:, None], rt - within(yt, mu * low), rc - within(yc, mu_r * low)])
    return np.linalg.norm(error) / max(np.linalg.norm(a) for a in (q, r, w @ r + q))


def rolling_statuses(w, q, mu, mu_r, r):
    """Numbers of contacts that are open, held, slide, roll, or do both."""
    (rn, _, _), (_, ut, uc) = rolling_parts(w, q, mu, r)
    speed = 1e-5 * max(np.abs(q).max(), 1e-300)
    closed = rn > 1e-9 * rn.max()
    slides, rolls = (np.linalg.norm(u, axis=1) > speed for u in (ut, uc))
    kinds = {
        "open": ~closed,
        "held": closed & ~slides & ~rolls,
        "slides": closed & slides & ~rolls,
        "rolls": closed & ~slides & rolls,
        "both": closed & slides & rolls,
    }
    return {kind: int(count.sum()) for kind, count in kinds.items()}
