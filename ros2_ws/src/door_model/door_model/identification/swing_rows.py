"""Rows of a least squares over swings that share some unknowns and have two of their own each."""

from collections.abc import Sequence

import numpy as np
from door_impact_common.arrays import Array

_PIECE = 64  # rows


def stack(blocks: Sequence[Array], shared: int) -> Array:
    """Rows of all swings from [columns of shared unknowns, of two of its own, others] of each.

    Each swing's rows are rotated down to a few (`triangle`) before they are put together: the
    costs, gradients and normal equations stay what they are, with 40 rows for five swings in place
    of 12,000.

    Returns:
        Rows of [shared, two for each swing, others].
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
    """Triangular matrix with the same products of columns as a tall one.

    By the QR decomposition of many short pieces: one of the whole would start the threads of
    the linear algebra library, which is slow where the cores are busy with a simulation.
    """
    columns = rows.shape[1]
    while len(rows) > _PIECE:
        pieces = -(-len(rows) // _PIECE)
        padded = np.zeros((pieces * _PIECE, columns))
        padded[: len(rows)] = rows
        stacked = np.linalg.qr(padded.reshape(pieces, _PIECE, columns), mode="r")
        rows = np.asarray(stacked).reshape(-1, columns)
    return np.asarray(np.linalg.qr(rows, mode="r"))
