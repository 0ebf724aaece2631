"""Rows of a least squares over swings that share unknowns and have two own unknowns each."""

from collections.abc import Sequence

import numpy as np
from door_impact_common.arrays import Array

_PIECE = 64  # number of rows that are decomposed together


def stack(blocks: Sequence[Array], shared: int) -> Array:
    """Stack the rows of all swings.

    Each swing's rows are first rotated to a triangular matrix with few rows (`triangle`). This does
    not change costs, gradients and normal equations, but leaves 40 rows for five swings in place of
    12,000.

    Args:
        blocks: Rows of each swing. Their columns are the shared unknowns, the swing's two own
            unknowns, and others.
        shared: Number of shared unknowns.

    Returns:
        Rows whose columns are the shared unknowns, two unknowns for each swing, and the others.
    """
    others = blocks[0].shape[1] - shared - 2
    rows = []
    for number, block in enumerate(blocks):
        small = triangle(block)
        wide = np.zeros((len(small), shared + 2 * len(blocks) + others))
        wide[:, :shared] = small[:, :shared]
        own = shared + 2 * number
        wide[:, own : own + 2] = small[:, shared : shared + 2]
        wide[:, -others:] = small[:, shared + 2 :]
        rows.append(wide)
    return np.vstack(rows)


def triangle(rows: Array) -> Array:
    """Return a triangular matrix whose columns have the same products as those of a tall matrix.

    It comes from QR decompositions of many short pieces. A decomposition of the whole matrix would
    start the threads of the linear algebra library, which is slow if a simulation keeps the cores
    busy.
    """
    columns = rows.shape[1]
    while len(rows) > _PIECE:
        pieces = -(-len(rows) // _PIECE)
        padded = np.zeros((pieces * _PIECE, columns))
        padded[: len(rows)] = rows
        stacked = np.linalg.qr(padded.reshape(pieces, _PIECE, columns), mode="r")
        rows = np.asarray(stacked).reshape(-1, columns)
    return np.asarray(np.linalg.qr(rows, mode="r"))
