"""Where a mask of what is seen may lack what something else hides.

A mask of the network's shows the object as far as it is seen. Fitted to it, an object that another
thing stands before would shrink away from that thing. So where the estimate reaches far beyond the
mask, the mask is taken to know nothing.
"""

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from r2art.run.refinement.body import Body
from r2art.run.refinement.pose import Posed
from r2art.run.refinement.silhouettes import NEAR

FloatArray = NDArray[np.floating]
Pixels = NDArray[np.bool_]

FAR = 0.1
"""Sides of the mask's window by which an estimate must reach beyond the mask: estimates of what
nothing hides seldom do."""
LEAST = 0.03
"""Share of the estimate's silhouette that must lie so far out."""


def hidden(body: Body, at: Posed, mask: FloatArray, K: FloatArray) -> Pixels:
    """(H, W) where the estimate is, but the mask, and something else may be before it.

    Args:
        body: The object.
        at: Where it is estimated to be (the first start).
        mask: (H, W) of what is seen of it, in [0, 1].
        K: Intrinsics of the mask.
    """
    height, width = mask.shape
    seen, shape = mask > 0.5, silhouette(body, at, K, (height, width))
    reach = round(FAR * width)
    far = shape & ~_grown(seen, reach)
    if far.sum() < max(1.0, LEAST * shape.sum()):
        return np.zeros_like(shape)
    return shape & ~seen & _grown(far, reach + 1)


def silhouette(body: Body, at: Posed, K: FloatArray, size: tuple[int, int]) -> Pixels:
    """(H, W) pixels that the convex hulls of the parts cover; none if one is behind the camera."""
    height, width = size
    canvas = Image.new("1", (width, height))
    pen = ImageDraw.Draw(canvas)
    for p, tips in enumerate(body.tips):
        x = at.rotation[0, p] @ tips + at.translation[0, p, :, None]
        if (x[2] < NEAR).any():
            return np.zeros(size, bool)
        u, v = (K @ (x / x[2]))[:2]
        pen.polygon(convex_hull(list(zip(u.tolist(), v.tolist(), strict=True))), fill=1)
    return np.array(canvas)


def convex_hull(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The corners of the convex hull of points of a plane, in order (Andrew's monotone chain)."""
    ordered = sorted(set(points))
    return ordered if len(ordered) < 3 else _chain(ordered) + _chain(ordered[::-1])


def _chain(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """One side of the hull, without its last corner."""
    chain: list[tuple[float, float]] = []
    for x, y in points:
        while len(chain) > 1:
            (x0, y0), (x1, y1) = chain[-2:]
            if (x1 - x0) * (y - y1) - (y1 - y0) * (x - x1) > 0:
                break
            chain.pop()
        chain.append((x, y))
    return chain[:-1]


def _grown(pixels: Pixels, by: int) -> Pixels:
    """With all pixels that are no farther away along rows and columns."""
    for axis in (0, 1):
        rows = np.moveaxis(pixels, axis, 0)
        count = np.cumsum(np.pad(rows, ((by + 1, by), (0, 0))), axis=0, dtype=np.int32)
        pixels = np.moveaxis(count[2 * by + 1 :] > count[: -2 * by - 1], 0, axis)
    return pixels
