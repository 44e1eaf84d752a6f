"""The mean object of a category, from many instances: its boxes, joints and surface points."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from r2art.core.category import Category, Joint
from r2art.data.pose import posed_vertices, root_T_part
from r2art.data.procedural import make_instance
from r2art.data.procedural.randomness import weighted
from r2art.data.shape import Instance, Surface

FloatArray = NDArray[np.floating]
POINTS_PER_OBJECT = 2048
_VIEWS_PER_INSTANCE = 6


def category_prior(name: str, seeds: Sequence[int]) -> Category:
    """Average a category over the instances of some seeds.

    Sizes are averaged in their logarithm, centres as they are, and each joint's pivot as the
    share of its child's box where it lies. Points are those of the instance nearest to the
    mean, stretched part by part into the mean boxes: as many on every part, evenly spread
    over its area.

    Args:
        name: The category.
        seeds: Of the instances to average; a few hundred make a steady mean.
    """
    instances = [make_instance(name, seed) for seed in seeds]
    boxes = [instance.part_boxes() for instance in instances]
    centers, log_sizes = np.stack([c for c, _ in boxes]), np.log([s for _, s in boxes])
    box_center, box_size = centers.mean(axis=0), np.exp(log_sizes.mean(axis=0))
    box_center[0] = 0.0
    offset = np.abs(centers - box_center) / box_size
    typical = int(np.argmin((np.abs(log_sizes - np.log(box_size)) + offset).sum(axis=(1, 2))))
    points, normals, areas = _surface_points(instances[typical], box_center, box_size)
    return Category(
        name=name,
        part_names=instances[0].part_names,
        joints=_mean_joints(instances, box_center, box_size),
        box_center=box_center,
        box_size=box_size,
        points=points,
        normals=normals,
        areas=areas,
        frontal_area=_frontal_area(instances),
    )


def _mean_joints(
    instances: Sequence[Instance], box_center: FloatArray, box_size: FloatArray
) -> tuple[Joint, ...]:
    """The joints of the mean object; their limits are the widest of all instances."""
    joints = []
    for j, joint in enumerate(instances[0].joints):
        shares = []
        for instance in instances:
            center, size = instance.part_boxes()
            shares.append((np.asarray(instance.joints[j].pivot) - center[j + 1]) / size[j + 1])
        x, y, z = (box_center[j + 1] + np.mean(shares, axis=0) * box_size[j + 1]).tolist()
        limits = np.array([instance.joints[j].limits for instance in instances])
        widest = float(limits[:, 0].min()), float(limits[:, 1].max())
        joints.append(replace(joint, pivot=(x, y, z), limits=widest))
    return tuple(joints)


def _surface_points(
    instance: Instance, box_center: FloatArray, box_size: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(P, M, 3) points and normals, and (P,) areas, of an instance stretched into the boxes."""
    rng = np.random.default_rng(0)
    center, size = instance.part_boxes()
    count = POINTS_PER_OBJECT // len(instance.parts)
    sampled = [
        _sample(rng, part, c, s, c0, s0, count)
        for part, c, s, c0, s0 in zip(
            instance.parts, center, size, box_center, box_size, strict=True
        )
    ]
    points, normals, areas = zip(*sampled, strict=True)
    return np.stack(points), np.stack(normals), np.array(areas)


def _sample(
    rng: np.random.Generator,
    surfaces: Sequence[Surface],
    center: FloatArray,
    size: FloatArray,
    new_center: FloatArray,
    new_size: FloatArray,
    count: int,
) -> tuple[FloatArray, FloatArray, float]:
    scale = new_size / size
    corners = np.concatenate([s.vertices[s.faces] for s in surfaces])
    corners = new_center + (corners - center) * scale
    shading = np.concatenate([s.normals[s.faces] for s in surfaces]) / scale
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1
    )
    area /= 2
    edges = np.cumsum(area) / area.sum()
    chosen = np.searchsorted(edges, (np.arange(count) + rng.random(count)) / count)
    a, b = rng.random((2, count))
    fold = a + b > 1
    a, b = np.where(fold, 1 - a, a), np.where(fold, 1 - b, b)
    weights = np.stack([1 - a - b, a, b], axis=-1)[:, :, None]
    normals = (weights * shading[chosen]).sum(axis=1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return (weights * corners[chosen]).sum(axis=1), normals, float(area.sum())


def _frontal_area(instances: Sequence[Instance]) -> float:
    """``S_wld`` of Eq. 1 (m²): log-mean, over typical photos, of ``S_bbox z² / (fx fy)``."""
    rng = np.random.default_rng(1)
    logs = [
        np.log(_box_area(rng, instance))
        for instance in instances
        for _ in range(_VIEWS_PER_INSTANCE)
    ]
    return float(np.exp(np.mean(logs)))


def _box_area(rng: np.random.Generator, instance: Instance) -> float:
    """Area (m²) of the box around one random view of an instance, at the root's depth."""
    vertices = posed_vertices(instance, root_T_part(instance.joints, _states(rng, instance)))
    azimuth = np.clip(rng.normal(0, np.radians(38)), -np.radians(110), np.radians(110))
    elevation = np.clip(rng.normal(np.radians(25), np.radians(14)), -0.15, 1.3)
    seen = vertices @ _looking(azimuth, elevation, rng.normal(0, np.radians(9))).T
    center = (seen.min(axis=0) + seen.max(axis=0)) / 2
    radius = np.linalg.norm(seen - center, axis=-1).max()
    fov = np.radians(rng.uniform(*weighted(rng, {(25, 40): 3, (40, 65): 5, (65, 90): 2})))
    wanted = rng.uniform(0.35, 0.97) * 2 * np.tan(fov / 2)  # longer side at unit focal length
    distance, extent = 2 * radius / wanted, np.ones(2)
    for _ in range(5):
        distance = max(distance, 1.15 * radius)
        points = seen - center + (0, 0, distance)
        points = points[points[:, 2] > 0.02 * radius]
        extent = np.ptp(points[:, :2] / points[:, 2:], axis=0)
        distance *= extent.max() / wanted
    return float(extent[0] * extent[1] * (distance - center[2]) ** 2)


def _states(rng: np.random.Generator, instance: Instance) -> FloatArray:
    """Joint states as photos show them: hinges mostly well open, slides often shut."""
    share = [
        (rng.beta(7, 2.5) if rng.random() < 0.75 else rng.random())
        if joint.kind == "revolute"
        else float(rng.random() > 0.35) * rng.random()
        for joint in instance.joints
    ]
    limits = np.array([joint.limits for joint in instance.joints])
    return limits[:, 0] + np.array(share) * (limits[:, 1] - limits[:, 0])


def _looking(azimuth: float, elevation: float, roll: float) -> FloatArray:
    """(3, 3) rotation from the root frame to a camera that looks at its origin."""
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    backward = np.array([sa * ce, se, ca * ce])
    right = np.array([ca, 0.0, -sa])
    level = np.stack([right, np.cross(right, backward), -backward])
    cr, sr = np.cos(roll), np.sin(roll)
    return np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]]) @ level
