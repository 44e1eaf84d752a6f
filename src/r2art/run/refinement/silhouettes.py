"""What refinement compares: soft silhouettes of a posed body, and masks made equally soft.

Silhouettes are those of `r2art.method.silhouette`: every point spreads the square pixels that its
patch covers over a kernel of integral 1, which adds up to surface layers L, and the coverage is
``A = 1 − 2^(−L²)``. Letters as in `body`; I images (one per part, or one of all) of G × G
pixels.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.run.refinement.body import Body
from r2art.run.refinement.errors import Errors
from r2art.run.refinement.pose import Pose, derivatives, posed

FloatArray = NDArray[np.floating]

RADIUS = 2.5
"""Pixels of the kernel, at every resolution."""
NEAR = 0.01
"""Metres; what is nearer contributes nothing."""
MARGIN = 0.2
"""Of the window around the mask, on each side, in units of the mask's longer side."""
TAPS = int(np.ceil(2 * RADIUS))


@dataclass(frozen=True, kw_only=True)
class Level:
    """A mask at one resolution.

    Attributes:
        focal: fx, fy (px) of the window's camera at this resolution.
        center: cx, cy (px), likewise.
        shares: (2 Q + 1, I, G, G) mask, spread by the kernel where points are rendered, and made
            wider and narrower all round: by −Q to Q times ``border``.
        border: A pixel of the masks, in x/z.
        weight: (I, G, G) 0 where the mask is not known.
        side: Of the mask's box (px), the mean of width and height.
    """

    focal: FloatArray
    center: FloatArray
    shares: FloatArray
    border: float
    weight: FloatArray
    side: float

    @property
    def size(self) -> int:
        """G."""
        return self.shares.shape[-1]

    @property
    def images(self) -> int:
        """I."""
        return self.shares.shape[1]

    def wanted(self, border: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(S, I, G, G) the object's silhouettes, if masks reach beyond it by (S,) ``border``,
        and the derivatives of the masks by it, with their sign turned.
        """
        most = len(self.shares) // 2
        if most == 0:
            return np.repeat(self.shares, len(border), 0), np.zeros(
                (len(border), *self.weight.shape)
            )
        at = np.clip(most - border / self.border, 0, 2 * most - 1e-9)
        low = at.astype(np.intp)
        rest = (at - low)[:, None, None, None]
        step = self.shares[low + 1] - self.shares[low]
        return self.shares[low] + rest * step, step / self.border


def pyramid(
    masks: FloatArray,
    known: FloatArray,
    K: FloatArray,
    box: FloatArray,
    sizes: tuple[int, ...],
    *,
    soft: bool,
    borders: int = 0,
) -> list[Level]:
    """The window around ``box`` of (I, H, W) masks at several resolutions.

    Args:
        masks: Share of each pixel that is the object, or a part of it.
        known: 0 where the mask may be wrong, for instance because something hides the object.
        K: (3, 3) intrinsics of the masks.
        box: ``x1 y1 x2 y2`` around what is set, in normalised image coordinates.
        sizes: G of every level.
        soft: Whether to spread masks as points are.
        borders: Q.
    """
    pixel = 1 / float(np.sqrt(K[0, 0] * K[1, 1]))
    box = box * np.tile([K[0, 0], K[1, 1]], 2) + np.tile(K[:2, 2], 2)
    extent = box[2:] - box[:2]
    side = float(extent.max()) * (1 + 2 * MARGIN)
    corner = (box[:2] + box[2:]) / 2 - side / 2
    low = np.maximum(np.floor(corner).astype(int) - borders, 0)
    high = np.maximum(np.ceil(corner + side).astype(int) + borders, 0)
    near = (..., slice(low[1], high[1]), slice(low[0], high[0]))
    known = known[near]
    grown = _grown(masks[near], known, borders)
    result = []
    for size in sizes:
        scale = size / side
        seen, shares = (_binned(pixels, corner - low, side, size) for pixels in (known, grown))
        shares = shares / np.maximum(seen, 1e-6)
        certain = seen > 0.99
        if soft:
            blur = _blur(size)
            certain = blur @ seen @ blur.T > 0.99
            shares = blur @ shares @ blur.T
        result.append(
            Level(
                focal=np.array([K[0, 0], K[1, 1]]) * scale,
                center=(K[:2, 2] - corner) * scale,
                shares=shares,
                border=pixel,
                weight=certain.astype(float),
                side=float(extent.mean()) * scale,
            )
        )
    return result


def _grown(masks: FloatArray, known: FloatArray, most: int) -> FloatArray:
    """(2 Q + 1, I, H, W) masks, what is known of them, narrower to wider pixel by pixel.

    Steps to four and to eight neighbours by turns make octagons, which are nearly round.
    """

    def steps(pixels: FloatArray) -> list[FloatArray]:
        result = []
        for step in range(most):
            pixels = _widened(pixels, corners=step % 2 == 1)
            result.append(pixels)
        return result

    wider = steps(masks * known)
    narrower = [1 - p for p in steps((1 - masks) * known)]
    return np.stack([*narrower[::-1], masks, *wider]) * known


def _widened(pixels: FloatArray, *, corners: bool) -> FloatArray:
    """(..., H, W) the greatest of each pixel and those beside it."""
    rows = pixels.copy()
    np.maximum(rows[..., 1:, :], pixels[..., :-1, :], out=rows[..., 1:, :])
    np.maximum(rows[..., :-1, :], pixels[..., 1:, :], out=rows[..., :-1, :])
    across = rows if corners else pixels
    result = rows.copy()
    np.maximum(result[..., 1:], across[..., :-1], out=result[..., 1:])
    np.maximum(result[..., :-1], across[..., 1:], out=result[..., :-1])
    return result


def _binned(pixels: FloatArray, corner: FloatArray, side: float, count: int) -> FloatArray:
    """(..., G, G) means over the squares of a window of (..., H, W) pixels, 0 beyond them.

    Sums, not a product with the squares' overlaps: BLAS would start threads for it.
    """
    for axis, start in ((-2, corner[1]), (-1, corner[0])):
        length = pixels.shape[axis]
        at = np.clip(start + side / count * np.arange(count + 1), 0, length)
        low = np.minimum(at.astype(np.intp), length - 1)
        along = (slice(None), None) if axis == -2 else slice(None)
        whole = np.take(np.add.reduceat(pixels, low, axis), range(count), axis)
        whole = whole * (np.diff(low) > 0)[along]  # of an empty stretch reduceat gives its begin
        pixels = whole + np.diff(np.take(pixels, low, axis) * (at - low)[along], axis=axis)
    return pixels * (count / side) ** 2


def _blur(size: int) -> FloatArray:
    """(G, G) the kernel, one row per pixel."""
    gap = np.arange(size)
    rows = np.clip(1 - ((gap[:, None] - gap) / RADIUS) ** 2, 0, None) ** 2
    return rows / rows[size // 2].sum()


def target(
    share: FloatArray, covered: FloatArray, by_border: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(S, I, G²) what the masks' coverage is if drawn like (S, I, G²) silhouettes.

    How full those are inside depends on how many layers the object has, and on how evenly its
    points lie; ``1 − 2^(−(n mask∗kernel)²)`` takes its n from there. Beside it the derivative by
    what the (S, I, G²) masks have ``by_border`` by.
    """
    square = covered**2
    total = np.maximum(square.sum(axis=-1, keepdims=True), 1e-9)
    inside = (square * covered).sum(axis=-1, keepdims=True) / total
    squared = -np.log2(1 - np.clip(inside, 0.5, 1 - 1e-4))
    passed = np.exp2(-squared * share**2)
    return 1 - passed, 2 * np.log(2) * squared * share * passed * by_border


@dataclass(frozen=True, kw_only=True)
class Spots:
    """Where points are seen, and the square pixels they cover.

    Attributes:
        uv: (S, P, 2, M) px; far outside for what is not before the camera.
        area: (S, P, M) px².
        by_uv: (S, P, D, 2, M) derivatives of ``uv`` ...
        by_area: (S, P, D, M) ... and ``area``.
    """

    uv: FloatArray
    area: FloatArray
    by_uv: FloatArray
    by_area: FloatArray


def spots(
    points: FloatArray,
    patches: FloatArray,
    by_points: FloatArray,
    by_patches: FloatArray,
    level: Level,
) -> Spots:
    """Project (S, P, 3, M) points and patches with their (S, P, D, 3, M) derivatives."""
    seen = points[:, :, 2] > NEAR
    z = np.where(seen, points[:, :, 2], 1.0)
    xy = points[:, :, :2] / z[:, :, None]
    focal_area = level.focal.prod() / z**3
    facing = (patches * points).sum(axis=2)
    area = np.where(seen, focal_area * np.abs(facing), 0.0)
    slope = np.where(seen, focal_area * np.sign(facing), 0.0)
    by_z = by_points[:, :, :, 2] / z[:, :, None]
    by_xy = by_points[:, :, :, :2] / z[:, :, None, None] - xy[:, :, None] * by_z[:, :, :, None]
    by_facing = (by_patches * points[:, :, None] + patches[:, :, None] * by_points).sum(axis=3)
    uv = xy * level.focal[:, None] + level.center[:, None]
    return Spots(
        uv=np.where(seen[:, :, None], np.clip(uv, -1e6, 1e6), -1e6),
        area=area,
        by_uv=by_xy * level.focal[:, None],
        by_area=slope[:, :, None] * by_facing - 3 * area[:, :, None] * by_z,
    )


def silhouettes(spots: Spots, size: int, *, by_part: bool) -> tuple[FloatArray, FloatArray]:
    """(S, I, G²) coverage and its (S, D, I, G²) derivatives."""
    S, P, D, M = spots.by_area.shape
    images = P if by_part else 1
    first = np.floor(spots.uv + (0.5 - RADIUS)).astype(np.int64)
    tap = first[..., None] + np.arange(TAPS)
    distance = (tap + 0.5 - spots.uv[..., None]) / RADIUS
    falloff = np.clip(1 - distance**2, 0, None)
    height = 15 / (16 * RADIUS)
    kernel, slope = height * falloff**2, (4 * height / RADIUS) * falloff * distance

    tap = np.clip(tap, -1, size) + 1
    stride = size + 2
    image = np.arange(S)[:, None] * images + (np.arange(P) if by_part else np.zeros(P, int))
    index = (image[..., None, None, None] * stride + tap[:, :, 1, :, :, None]) * stride
    index = (index + tap[:, :, 0, :, None, :]).ravel()

    # Value and slopes of every tap of every point: (S, P, M, 3, taps²).
    shapes = np.empty((S, P, M, 3, TAPS, TAPS))
    across, down = kernel[:, :, 0, :, None, :], kernel[:, :, 1, :, :, None]
    np.multiply(down, across, out=shapes[:, :, :, 0])
    np.multiply(down, slope[:, :, 0, :, None, :], out=shapes[:, :, :, 1])
    np.multiply(slope[:, :, 1, :, :, None], across, out=shapes[:, :, :, 2])
    shapes = shapes.reshape(S, P, M, 3, TAPS * TAPS)

    def gathered(weights: FloatArray) -> FloatArray:
        canvas = np.bincount(index, weights.ravel(), S * images * stride**2).astype(
            float, copy=False
        )
        return canvas.reshape(S, images, stride, stride)[..., 1:-1, 1:-1].reshape(S, images, -1)

    layers = gathered(spots.area[..., None] * shapes[:, :, :, 0])
    passed = np.exp2(-(layers**2))
    coefficients = np.empty((S, P, M, D, 3))
    coefficients[..., 0] = spots.by_area.transpose(0, 1, 3, 2)
    coefficients[..., 1:] = (spots.area[:, :, None, None] * spots.by_uv).transpose(0, 1, 4, 2, 3)
    values = coefficients @ shapes
    by_layers = np.stack([gathered(values[:, :, :, d]) for d in range(D)], axis=1)
    return 1 - passed, (2 * np.log(2) * layers * passed)[:, None] * by_layers


def pixel_errors(body: Body, pose: Pose, level: Level, *, scale: bool) -> Errors:
    """Of (S, I G²) the silhouettes."""
    at = posed(body, pose)
    by_points, by_patches = derivatives(body, pose, at, scale=scale)
    seen = spots(at.points, at.patches, by_points, by_patches, level)
    covered, slopes = silhouettes(seen, level.size, by_part=level.images > 1)
    weight = level.weight.reshape(level.images, -1)
    share, by_border = (a.reshape(covered.shape) for a in level.wanted(pose.border))
    wanted, slopes[:, body.border] = target(share, covered, by_border)
    error = (covered - wanted) * weight
    S, D = slopes.shape[:2]
    return Errors(
        error=error.reshape(S, -1),
        slopes=(slopes * weight).reshape(S, D, -1),
        moving=np.arange(weight.size),
    )
