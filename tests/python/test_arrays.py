"""Arrays as other programs hand them over: their memory does not matter."""

import numpy as np
import pytest

import tdcr

ROBOT = tdcr.Robot(tdcr.Backbone(0.1, 4), [tdcr.Tendon(2.1 * k, 0.008) for k in range(3)])


def misaligned(array):
    """Return a contiguous copy that begins at an odd address, as numbers within a file's bytes."""
    data = b"x" + array.tobytes()
    copy = np.frombuffer(data, dtype=array.dtype, offset=1).reshape(array.shape)
    assert copy.flags.c_contiguous
    assert not copy.flags.aligned
    return copy


def read_only(array):
    """Return a copy that cannot be written."""
    copy = array.copy()
    copy.flags.writeable = False
    return copy


def strided(array):
    """Return a view of every other number of a larger array."""
    return np.repeat(array, 2, axis=-1)[..., ::2]


KINDS = {
    "misaligned": misaligned,
    "misaligned Fortran": lambda array: misaligned(array.T).T,
    "Fortran": np.asfortranarray,
    "read-only": read_only,
    "strided": strided,
    "reversed": lambda array: array[..., ::-1].copy()[..., ::-1],
    "big-endian": lambda array: array.astype(array.dtype.newbyteorder(">")),
    "list": lambda array: array.tolist(),
}


@pytest.mark.parametrize("kind", KINDS)
def test_memory_does_not_matter(kind):
    made = KINDS[kind]
    targets = np.array([[0.0, 0.03, 0.09], [0.01, 0.02, 0.09]])
    pulls = np.array([[-0.001, np.inf, np.inf], [-0.002, np.inf, np.inf]])
    calls = [
        lambda m: tdcr.inverse_batch(ROBOT, m(targets), start=m(pulls)).displacements,
        lambda m: tdcr.inverse(ROBOT, positions=m(np.tile(targets, (2, 1)))).displacements,
        lambda m: tdcr.forward_batch(ROBOT, m(pulls)).tip,
        lambda m: tdcr.Robot(ROBOT.backbone, ROBOT.tendons, base=m(2.0 * np.eye(4) / 2.0)).base,
        lambda m: tdcr.Sphere((0.0, 0.0, 0.0), 1.0).distance(m(targets)),
        lambda m: tdcr.Mesh(m(CORNERS), m(FACES)).faces,
    ]
    for call in calls:
        np.testing.assert_array_equal(call(made), call(lambda array: array))


CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


@pytest.mark.parametrize("dtype", ["f4", "f2", "i4", "u2", "longdouble"])
def test_numbers_of_other_types_are_converted(dtype):
    target = np.array([0, 0, 1]).astype(dtype)
    same = tdcr.Sphere((0.0, 0.0, 0.0), 0.5).distance(misaligned(target[None]))
    np.testing.assert_array_equal(same, [0.5])
