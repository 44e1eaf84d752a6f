"""Poses of several starts at once, the steps between them, and how points answer to a step.

Letters and degrees of freedom as in `body`. Metres, radians, OpenCV camera axes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.run.refinement.body import IMAGE_FREEDOM, Body

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Pose:
    """Where S starts have the body.

    Attributes:
        rotation: (S, 3, 3) of the root, into the camera frame.
        anchor: (S, 3) place (m) of `Body.anchor` in the camera frame.
        joint_state: (S, J) rad, m.
        log_scale: (S, P, 3) logarithm of each part's scale, relative to the body.
        border: (S,) how far masks reach beyond the object all round, in x/z and y/z.
    """

    rotation: FloatArray
    anchor: FloatArray
    joint_state: FloatArray
    log_scale: FloatArray
    border: FloatArray

    def pick(self, which: NDArray[np.integer]) -> "Pose":
        """Some of the starts."""
        return Pose(**{k: v[which] for k, v in vars(self).items()})

    def put(self, which: NDArray[np.integer], others: "Pose") -> "Pose":
        """With ``others`` in place of some of the starts."""
        result = {k: v.copy() for k, v in vars(self).items()}
        for name, value in vars(others).items():
            result[name][which] = value
        return Pose(**result)

    def beside(self, other: "Pose") -> "Pose":
        """The starts of both."""
        return Pose(**{k: np.concatenate([v, vars(other)[k]]) for k, v in vars(self).items()})


def pose_of(body: Body, cam_T_root: FloatArray, joint_state: FloatArray) -> Pose:
    """The pose of one start, in the body's own shape."""
    rotation = np.asarray(cam_T_root, float)[:3, :3]
    return Pose(
        rotation=rotation[None],
        anchor=(rotation @ body.anchor + np.asarray(cam_T_root, float)[:3, 3])[None],
        joint_state=np.asarray(joint_state, float)[None],
        log_scale=np.zeros((1, *body.center.shape)),
        border=np.zeros(1),
    )


def moved(body: Body, pose: Pose, step: FloatArray) -> Pose:
    """The pose after a step of (S, D); joints stay within their limits."""
    z = pose.anchor[:, 2:] * np.exp(step[:, 5:6])
    xy = pose.anchor[:, :2] / pose.anchor[:, 2:] + step[:, 3:5]
    state = pose.joint_state + step[:, IMAGE_FREEDOM : body.border]
    scale = step[:, body.freedom :].reshape(len(step), -1, 3)
    return Pose(
        rotation=rotation_of(step[:, :3]) @ pose.rotation,
        anchor=np.concatenate([xy * z, z], axis=-1),
        joint_state=np.clip(state, body.limits[:, 0], body.limits[:, 1]),
        log_scale=pose.log_scale + (scale if scale.size else 0),
        border=pose.border + step[:, body.border],
    )


def difference(body: Body, pose: Pose, other: Pose, *, scale: bool) -> FloatArray:
    """(S, D) the step that leads from ``other`` to ``pose``."""
    position = [p.anchor[:, :2] / p.anchor[:, 2:] for p in (pose, other)]
    log_z = np.log(pose.anchor[:, 2:] / other.anchor[:, 2:])
    parts = [
        vector_of(pose.rotation @ other.rotation.transpose(0, 2, 1)),
        position[0] - position[1],
        log_z,
        pose.joint_state - other.joint_state,
        (pose.border - other.border)[:, None],
    ]
    if scale:
        parts.append((pose.log_scale - other.log_scale).reshape(len(log_z), -1))
    return np.concatenate(parts, axis=-1)


def rotation_of(vector: FloatArray) -> FloatArray:
    """(..., 3) rotation vectors (rad) to (..., 3, 3) matrices."""
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    k = _cross_matrix(vector)
    near_zero = angle < 1e-8
    safe = np.where(near_zero, 1.0, angle)
    a = np.where(near_zero, 1.0, np.sin(safe) / safe)
    b = np.where(near_zero, 0.5, (1 - np.cos(safe)) / safe**2)
    return np.eye(3) + a * k + b * (k @ k)


def vector_of(rotation: FloatArray) -> FloatArray:
    """The inverse of `rotation_of`, for angles below π."""
    R = rotation
    v = np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1
    )
    sine = np.linalg.norm(v, axis=-1, keepdims=True)
    angle = np.arctan2(sine, np.trace(R, axis1=-2, axis2=-1)[..., None] - 1)
    return v * np.where(sine < 1e-9, 0.5, angle / np.maximum(sine, 1e-300))


def _cross_matrix(v: FloatArray) -> FloatArray:
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    o = np.zeros_like(x)
    return np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape(*v.shape, 3)


@dataclass(frozen=True, kw_only=True)
class Posed:
    """A body in the camera frame.

    Attributes:
        points: (S, P, 3, M) m.
        patches: (S, P, 3, M) normals times areas (m²).
        rotation: (S, P, 3, 3) of every part.
        translation: (S, P, 3) of every part (m).
        axis: (S, J, 3) unit direction of every joint, where it is now.
        pivot: (S, J, 3) a point (m) on its line, likewise.
    """

    points: FloatArray
    patches: FloatArray
    rotation: FloatArray
    translation: FloatArray
    axis: FloatArray
    pivot: FloatArray


def posed(body: Body, pose: Pose) -> Posed:
    """The body as S starts have it; scales act as in `r2art.method.shape.deform`."""
    at_rest, patches = body.points, body.patches
    pivot = np.broadcast_to(body.pivot, (len(pose.rotation), *body.pivot.shape))
    if pose.log_scale.any():
        scale = np.exp(pose.log_scale)
        center = scale[:, :1] * body.center
        at_rest = center[..., None] + scale[..., None] * body.local
        patches = body.patches * (scale.prod(axis=-1, keepdims=True) / scale)[..., None]
        pivot = center[:, 1:] + scale[:, 1:] * (body.pivot - body.center[1:])
    local = _joint_motions(body, pivot, pose.joint_state)
    root = np.tile(np.eye(4), (len(pivot), 1, 1))
    root[:, :3, :3] = pose.rotation
    root[:, :3, 3] = pose.anchor - pose.rotation @ body.anchor
    chain = [root]
    for j, parent in enumerate(body.parent):
        chain.append(chain[parent] @ local[:, j])
    T = np.stack(chain, axis=1)
    R, t = T[:, :, :3, :3], T[:, :, :3, 3]
    hung = R[:, list(body.parent)], t[:, list(body.parent)]
    return Posed(
        points=R @ at_rest + t[..., None],
        patches=R @ patches,
        rotation=R,
        translation=t,
        axis=(hung[0] @ body.axis[..., None])[..., 0],
        pivot=(hung[0] @ pivot[..., None])[..., 0] + hung[1],
    )


def _joint_motions(body: Body, pivot: FloatArray, state: FloatArray) -> FloatArray:
    """(S, J, 4, 4) each joint's motion away from rest, about (S, J, 3) pivots."""
    angle = np.where(body.prismatic, 0.0, state)[..., None, None]
    turns = body.turns
    turned = np.eye(3) + np.sin(angle) * turns + (1 - np.cos(angle)) * (turns @ turns)
    slid = np.where(body.prismatic, state, 0.0)[..., None] * body.axis
    result = np.zeros((*state.shape, 4, 4))
    result[..., 3, 3] = 1
    result[..., :3, :3] = turned
    result[..., :3, 3] = slid + pivot - (turned @ pivot[..., None])[..., 0]
    return result


def derivatives(body: Body, pose: Pose, at: Posed, *, scale: bool) -> tuple[FloatArray, FloatArray]:
    """(S, P, D, 3, M) how points and patches move with every degree of freedom."""
    S, P, _, M = at.points.shape
    J = len(body.parent)
    by_points = np.zeros((S, P, body.freedom + (3 * P if scale else 0), 3, M))
    by_patches = np.zeros_like(by_points)
    arm = at.points - pose.anchor[:, None, :, None]
    for axis in range(3):
        after, last = (axis + 1) % 3, (axis + 2) % 3
        for by, vector in ((by_points, arm), (by_patches, at.patches)):
            by[:, :, axis, after] = -vector[:, :, last]
            by[:, :, axis, last] = vector[:, :, after]
    by_points[:, :, 3, 0] = by_points[:, :, 4, 1] = pose.anchor[:, None, 2, None]
    by_points[:, :, 5] = pose.anchor[:, None, :, None]
    for j in range(J):
        axis = at.axis[:, j, :, None]
        for p in np.flatnonzero(body.carried[j]):
            if body.prismatic[j]:
                by_points[:, p, IMAGE_FREEDOM + j] = axis
            else:
                by_points[:, p, IMAGE_FREEDOM + j] = _cross(
                    axis, at.points[:, p] - at.pivot[:, j, :, None]
                )
                by_patches[:, p, IMAGE_FREEDOM + j] = _cross(axis, at.patches[:, p])
    if scale:
        _add_scale_derivatives(body, pose, at, by_points, by_patches)
    return by_points, by_patches


def _add_scale_derivatives(
    body: Body, pose: Pose, at: Posed, by_points: FloatArray, by_patches: FloatArray
) -> None:
    """A part's scale stretches it, and shifts it and others."""
    scale = np.exp(pose.log_scale)
    by_points[:, :, body.freedom :] += shifts(body, pose, at)[..., None]
    for part in range(len(body.center)):
        for axis in range(3):
            d = body.freedom + 3 * part + axis
            size = scale[:, part, axis, None]
            along = at.rotation[:, part, :, axis, None]
            by_points[:, part, d] += along * (size * body.local[part, axis])[:, None]
            inside = at.rotation[:, part, :, axis][:, None] @ at.patches[:, part]
            by_patches[:, part, d] += at.patches[:, part] - along * inside


def shifts(body: Body, pose: Pose, at: Posed) -> FloatArray:
    """(S, P, 3 P, 3) how parts are shifted by the logarithm of each part's scale: the root's
    shifts all centres, every part's own the pivot of its joint.
    """
    scale = np.exp(pose.log_scale)
    S, P = scale.shape[:2]
    result = np.zeros((S, P, P, 3, 3))
    along = at.rotation.swapaxes(-1, -2)
    result[:, :, 0] = along * (scale[:, :1] * body.center)[..., None]
    for j, parent in enumerate(body.parent):
        own = j + 1
        bent = along[:, parent] - along[:, own]
        offset = body.pivot[j] - body.center[own]
        carried = body.carried[j]
        result[:, carried, 0] += (bent * (scale[:, 0] * body.center[own])[..., None])[:, None]
        result[:, carried, own] += (bent * (scale[:, own] * offset)[..., None])[:, None]
    return result.reshape(S, P, 3 * P, 3)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """``a × b`` of (S, 3, 1) and (S, 3, M)."""
    return np.stack(_components(a[:, 0], a[:, 1], a[:, 2], b[:, 0], b[:, 1], b[:, 2]), axis=1)


def _components(
    p: FloatArray, q: FloatArray, r: FloatArray, x: FloatArray, y: FloatArray, z: FloatArray
) -> list[FloatArray]:
    return [q * z - r * y, r * x - p * z, p * y - q * x]
