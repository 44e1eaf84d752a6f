"""The category of another dataset: the mean of its objects, and how large photos show them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from r2art.core.camera import Camera
from r2art.core.category import Category, Joint
from r2art.data.adapters.model import Model
from r2art.data.categories import with_symmetries
from r2art.data.prior import POINTS_PER_OBJECT

FloatArray = NDArray[np.floating]
LEAST_LIMIT = 1e-3  # rad or m that a joint can open at least, even if no photo shows it
NEIGHBOURS = 12  # points around one, from which its surface is guessed


def dataset_category(
    name: str,
    part_names: tuple[str, ...],
    models: Sequence[Model],
    states: FloatArray,
    areas: Sequence[float],
) -> Category:
    """Average the objects of a dataset as `r2art.data.prior.category_prior` does its instances.

    Args:
        name: Of the category.
        part_names: P names.
        models: Its objects.
        states: (N, J) joint states of its photos; limits are widened to hold them.
        areas: ``frontal_area`` of some of its photos.
    """
    areas = [area for area in areas if area > 0]
    centers = np.stack([m.box_center for m in models])
    log_sizes = np.log([m.box_size for m in models])
    box_center, box_size = centers.mean(axis=0), np.exp(log_sizes.mean(axis=0))
    box_center[0] = 0.0
    offset = np.abs(centers - box_center) / box_size
    typical = int(np.argmin((np.abs(log_sizes - np.log(box_size)) + offset).sum(axis=(1, 2))))
    points, normals, surface = _points(models[typical], box_center, box_size)
    category = Category(
        name=name,
        part_names=part_names,
        joints=_joints(models, states, box_center, box_size),
        box_center=box_center,
        box_size=box_size,
        points=points,
        normals=normals,
        areas=surface,
        frontal_area=float(np.exp(np.mean(np.log(areas)))) if len(areas) else 1.0,
    )
    return with_symmetries(category)


def frontal_area(camera: Camera, box: FloatArray, depth: float) -> float:
    """What one photo says of ``S_wld`` (Eq. 1): ``S_bbox z² / (fx fy)``, in m²; 0: nothing."""
    width, height = box[2:] - box[:2]
    if min(width, height, depth) <= 0:
        return 0.0
    return float(width * height * depth**2 / (camera.fx * camera.fy))


def with_limits(joints: Sequence[Joint], states: FloatArray, longest: float) -> tuple[Joint, ...]:
    """The joints, their limits widened to hold all of some (N, J) states that can be meant.

    Args:
        joints: J joints.
        states: Of photos, some of which may be wrong.
        longest: Length (m) by which nothing slides.
    """
    most = [longest if joint.kind == "prismatic" else 2 * np.pi for joint in joints]
    own = np.reshape([joint.limits for joint in joints], (-1, 2)).T
    possible = np.where(np.abs(states) <= most, states, own[0])
    widest = np.concatenate([own, possible])
    low, high = widest.min(axis=0), widest.max(axis=0)
    high = np.maximum(high, low + LEAST_LIMIT)
    return tuple(
        replace(joint, limits=(a, b))
        for joint, a, b in zip(joints, low.tolist(), high.tolist(), strict=True)
    )


def _joints(
    models: Sequence[Model], states: FloatArray, box_center: FloatArray, box_size: FloatArray
) -> tuple[Joint, ...]:
    joints = []
    for j, joint in enumerate(models[0].joints):
        axis = np.mean([m.joints[j].axis for m in models], axis=0)
        length = np.linalg.norm(axis)
        axis = axis / length if length > 1e-6 else np.asarray(joint.axis)
        shares = [
            (np.asarray(m.joints[j].pivot) - m.box_center[j + 1]) / m.box_size[j + 1]
            for m in models
        ]
        pivot = box_center[j + 1] + np.mean(shares, axis=0) * box_size[j + 1]
        joints.append(replace(joint, axis=tuple(axis.tolist()), pivot=tuple(pivot.tolist())))
    return with_limits(joints, states, longest=2 * float(np.linalg.norm(box_size, axis=1).max()))


def _points(
    typical: Model, box_center: FloatArray, box_size: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(P, M, 3) points and normals and (P,) areas of an object stretched into the mean boxes."""
    rng = np.random.default_rng(0)
    parts, count = len(box_size), POINTS_PER_OBJECT // len(box_size)
    sampled = []
    for p in range(parts):
        stretch = box_size[p] / typical.box_size[p]
        points = box_center[p] + (typical.surface(p) - typical.box_center[p]) * stretch
        normals, areas = surface_of(points)
        weight = areas / areas.sum()
        ends = np.cumsum(weight)
        chosen = np.searchsorted(ends / ends[-1], (np.arange(count) + rng.random(count)) / count)
        sampled.append((points[chosen], normals[chosen], areas.sum()))
    points, normals, areas = zip(*sampled, strict=True)
    return np.stack(points), np.stack(normals), np.array(areas)


def surface_of(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N, 3) unit outward normals and (N,) areas of points spread over a surface, guessed.

    The normal is the direction in which a point's neighbours spread least, turned away from the
    middle of all; the area is the share of the disc that just holds the neighbours.
    """
    count = min(NEIGHBOURS, len(points) - 1)
    distance, near = KDTree(points).query(points, k=count + 1)
    around = points[near] - points[near].mean(axis=1, keepdims=True)
    _, axes = np.linalg.eigh(around.swapaxes(-1, -2) @ around)
    normals = axes[:, :, 0]
    outward = points - (points.min(axis=0) + points.max(axis=0)) / 2
    normals *= np.where((normals * outward).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    return normals, np.maximum(np.pi * distance[:, -1] ** 2 / count, 1e-12)
