"""How errors answer to steps, by way of the parts' motions as rigid bodies.

A degree of freedom moves every part by a *twist*: it turns with ω about the camera and is carried
along by v, so that a point at x moves with ω × x + v. An error that changes with a point as the
covector g says changes with the twist as the *wrench* (x × g, g) does: six numbers, however many
joints there are. Where sizes move, three more of every part stretch it along its own axes.
Letters as in `body`; Q = 6, or 9 where sizes move.
"""

import numpy as np
from numpy.typing import NDArray

from r2art.run.refinement.body import IMAGE_FREEDOM, Body
from r2art.run.refinement.pose import Pose, Posed, shifts

FloatArray = NDArray[np.floating]
Indices = NDArray[np.integer]


def twists(body: Body, pose: Pose, at: Posed, *, scale: bool) -> FloatArray:
    """(S, D, P Q) of every part, by every degree of freedom."""
    S, P = at.rotation.shape[:2]
    J = len(body.parent)
    Q = 9 if scale else 6
    result = np.zeros((S, body.freedom + (3 * P if scale else 0), P, Q))
    anchor = pose.anchor[:, None]
    for axis in range(3):
        after, last = (axis + 1) % 3, (axis + 2) % 3
        result[:, axis, :, axis] = 1
        result[:, axis, :, 3 + after] = anchor[..., last]
        result[:, axis, :, 3 + last] = -anchor[..., after]
    result[:, 3, :, 3] = result[:, 4, :, 4] = anchor[..., 2]
    result[:, 5, :, 3:6] = anchor
    slides = body.prismatic[:, None]
    motion = np.empty((S, J, 6))
    motion[..., :3] = np.where(slides, 0.0, at.axis)
    motion[..., 3:] = np.where(slides, at.axis, crossed(at.pivot, at.axis))
    joints = slice(IMAGE_FREEDOM, body.border)
    result[:, joints, :, :6] = motion[:, :, None] * body.carried[:, :, None]
    if scale:
        result[:, body.freedom :, :, 3:6] = shifts(body, pose, at).swapaxes(1, 2)
        stretch = result[:, body.freedom :].reshape(S, P, 3, P, Q)
        own = np.arange(P)
        for axis in range(3):
            stretch[:, own, axis, own, 6 + axis] = 1
    return result.reshape(S, -1, P * Q)


def wrenches(
    body: Body,
    pose: Pose,
    at: Posed,
    start: Indices,
    part: Indices,
    rest: FloatArray,
    x: FloatArray,
    pull: FloatArray,
    *,
    scale: bool,
) -> FloatArray:
    """(..., N, Q) of covectors at points.

    Args:
        body: The object ...
        pose: ... as it is ...
        at: ... posed.
        start: (N,) whose pose each point has.
        part: (N,) that it is on.
        rest: (..., N, 3) where it is at rest, before the part is scaled (m).
        x: (..., N, 3) where it is in the camera frame (m).
        pull: (..., N, 3) covectors.
        scale: Whether sizes move.
    """
    loads = [crossed(x, pull), pull]
    if scale:
        local = (rest - body.center[part]) * np.exp(pose.log_scale)[start, part]
        loads.append((pull[..., None] * at.rotation[start, part]).sum(axis=-2) * local)
    return np.concatenate(loads, axis=-1)


def crossed(a: FloatArray, b: FloatArray) -> FloatArray:
    """``a × b`` of (..., 3)."""
    p, q, r = a[..., 0], a[..., 1], a[..., 2]
    x, y, z = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([q * z - r * y, r * x - p * z, p * y - q * x], axis=-1)
