import numpy as np
from hrp2_sim_bridge.physics.frames import cross, into_frame, quaternion_product, rotation
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_rotation_is_scipys(seed) -> None:
    """The matrices of a stack of quaternions are those of SciPy."""
    turns = Rotation.random(6, random_state=np.random.default_rng(seed))
    quaternions = turns.as_quat().reshape(2, 3, 4)
    np.testing.assert_allclose(
        rotation(quaternions).reshape(6, 3, 3), turns.as_matrix(), atol=1e-12
    )


@given(seeds)
def test_cross_product_is_numpys(seed) -> None:
    """The cross products of stacks of vectors are those of NumPy."""
    a, b = np.random.default_rng(seed).standard_normal((2, 4, 5, 3))
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), atol=1e-12)


@given(seeds)
def test_into_frame_undoes_the_rotation(seed) -> None:
    """A vector that rotates with its frame keeps its components."""
    random = np.random.default_rng(seed)
    turn = rotation(Rotation.random(random_state=random).as_quat())
    vector = random.standard_normal(3)
    np.testing.assert_allclose(into_frame(turn, turn @ vector), vector, atol=1e-12)


@given(seeds)
def test_product_turns_by_both(seed) -> None:
    """The matrix of a product of quaternions is the product of their matrices."""
    p, q = Rotation.random(2, random_state=np.random.default_rng(seed)).as_quat()
    both = rotation(np.array(quaternion_product(p, q)))
    np.testing.assert_allclose(both, rotation(p) @ rotation(q), atol=1e-12)
