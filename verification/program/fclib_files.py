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


def write_local(path, w, q, mu, kind="columns"):
    with h5py.File(path, "w") as file:
        file["fclib_local/spacedim"] = np.array([len(q) // len(mu)], np.int32)
        write_matrix(file, "fclib_local/W", w, kind)
        file["fclib_local/vectors/q"], file["fclib_local/vectors/mu"] = q, mu
    return path


def write_global(path, m, h, f, w, mu, kind="triplets"):
    with h5py.File(path, "w") as file:
        file["fclib_global/spacedim"] = np.array([len(w) // len(mu)], np.int32)
        write_matrix(file, "fclib_global/M", m, kind)
        write_matrix(file, "fclib_global/H", h, kind)
        for name, values in (("f", f), ("w", w), ("mu", mu)):
            file[f"fclib_global/vectors/{name}"] = values
    return path


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
