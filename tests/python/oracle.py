"""Brute force in float64, and where rounding may decide."""

import numpy as np


def distances(a, b):
    """Distances of all pairs of points, in float64."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    return np.linalg.norm(a[:, None, :] - b[None, :, :], axis=-1)


def touching(first, first_radii, second, second_radii):
    """Matrix of the touching pairs of two sets of spheres. No pair may be so close to touching that
    rounding to the type of the positions decides."""
    gap = distances(first, second) - (np.asarray(first_radii, np.float64).reshape(-1, 1)
                                      + np.asarray(second_radii, np.float64).reshape(1, -1))
    error = 8 * np.finfo(np.asarray(first).dtype).eps * max(1, np.abs(first).max(initial=0))
    decided = np.abs(gap) > error
    return gap <= 0, decided


def half_pairs(positions, radii):
    """Touching pairs a < b, sorted, as a set, and the pairs that rounding decides."""
    n = len(positions)
    radii = np.broadcast_to(radii, n)
    touch, decided = touching(positions, radii, positions, radii)
    upper = np.triu(np.ones((n, n), bool), 1)
    return pairs_of(touch & decided & upper), pairs_of(~decided & upper)


def pairs_of(matrix):
    return set(zip(*(index.tolist() for index in np.nonzero(matrix))))


def check_pairs(found, certain, uncertain):
    """`found` (2, E) is sorted, without duplicates, has all certain pairs and no false one."""
    pairs = list(zip(found[0].tolist(), found[1].tolist()))
    assert pairs == sorted(set(pairs))
    assert certain <= set(pairs)
    assert set(pairs) <= certain | uncertain
