"""How deep points lie in an object, for the tests: its generalised winding number."""

import numpy as np

from r2art.data.pose import root_T_part
from r2art.data.shape import Instance


def winding_number(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(N,) closed solids around each of (N, 3) points, from (F, 3, 3) outward triangles.

    The sum of the triangles' solid angles (van Oosterom and Strackee 1983) over 4π.
    """
    a, b, c = np.moveaxis(triangles[None] - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    volume = np.einsum("nfc,nfc->nf", a, np.cross(b, c))
    ab, bc, ca = (np.einsum("nfc,nfc->nf", u, v) for u, v in ((a, b), (b, c), (c, a)))
    angle = 2 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    return angle.sum(axis=1) / (4 * np.pi)


def share_inside(instance: Instance, state: float, count: int = 150) -> float:
    """Share of points on the part of joint 0 that lie within the root part."""
    rng = np.random.default_rng(0)
    root, part = (
        np.concatenate([s.vertices[s.faces] for s in surfaces]) for surfaces in instance.parts[:2]
    )
    area = np.linalg.norm(np.cross(part[:, 1] - part[:, 0], part[:, 2] - part[:, 0]), axis=-1)
    chosen = part[rng.choice(len(part), count, p=area / area.sum())]
    points = np.einsum("nk,nkc->nc", rng.dirichlet(np.ones(3), count), chosen)
    T = root_T_part(instance.joints, np.array([state]))[1]
    return float((winding_number(points @ T[:3, :3].T + T[:3, 3], root) > 0.6).mean())
