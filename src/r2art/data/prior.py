"""The mean object of a category, from many instances: its boxes, joints and surface points."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from r2art.core.category import Category, Joint
from r2art.core.mesh import Mesh
from r2art.data.categories import with_symmetries
from r2art.data.coarse import coarse_mesh
from r2art.data.pose import posed_vertices, root_T_part
from r2art.data.shape import Instance, Surface
from r2art.data.staging import Staging, place_object

FloatArray = NDArray[np.floating]
POINTS_PER_OBJECT = 2048
SHAPE_MODES = 8
KEYPOINTS = 5
"""On every part of objects that are all the same: its middle, and the rest far apart."""
SAME_SHAPE = 1e-6
"""Greatest spread of sizes (logarithms) that is none."""
SAME_SIZE = 0.05
"""Greatest difference of the logarithms of part sizes of what is the same mean object."""
_VIEWS = 1536


def category_prior(instances: Sequence[Instance], staging: Staging) -> Category:
    """Average a category over some of its instances; a few hundred make a steady mean.

    Sizes are averaged in their logarithm, centres as they are, and each joint's pivot as the
    share of its child's box where it lies. Points are those of the instance nearest to the
    mean, stretched part by part into the mean boxes: as many on every part, evenly spread
    over its area. The mesh is that instance's, likewise, as few triangles.

    Args:
        instances: Of one category.
        staging: How they are photographed, which decides how large they appear (``S_wld``).
    """
    boxes = [instance.part_boxes() for instance in instances]
    centers, log_sizes = np.stack([c for c, _ in boxes]), np.log([s for _, s in boxes])
    box_center, box_size = centers.mean(axis=0), np.exp(log_sizes.mean(axis=0))
    box_center[0] = 0.0
    typical = _typical(centers, np.exp(log_sizes), box_center, box_size)
    points, normals, areas = _surface_points(instances[typical], box_center, box_size)
    are_same = np.ptp(log_sizes, axis=0).max() < SAME_SHAPE
    category = Category(
        name=instances[0].category,
        part_names=instances[0].part_names,
        joints=_mean_joints(instances, box_center, box_size),
        box_center=box_center,
        box_size=box_size,
        points=points,
        normals=normals,
        areas=areas,
        frontal_area=_frontal_area(instances, staging),
        size_spread=_size_spread(centers, np.exp(log_sizes)),
        shape_basis=shape_basis(centers, np.exp(log_sizes), box_center, box_size),
        mesh=_mesh(instances[typical], box_center, box_size),
        keypoints=keypoints_of(points, box_center) if are_same else None,
    )
    return with_symmetries(category)


def with_mesh(category: Category, instances: Sequence[Instance]) -> Category:
    """A category of before priors had meshes, with that of the instance nearest to its mean.

    Args:
        category: Unchanged where its mean object is not that of the instances.
        instances: As many as it was averaged over, or so.
    """
    if instances[0].part_names != category.part_names:
        return category
    boxes = [instance.part_boxes() for instance in instances]
    centers, sizes = np.stack([c for c, _ in boxes]), np.stack([s for _, s in boxes])
    apart = np.abs(np.log(sizes).mean(axis=0) - np.log(category.box_size))
    if apart.max() > SAME_SIZE:
        return category
    mean = category.box_center, category.box_size
    return replace(category, mesh=_mesh(instances[_typical(centers, sizes, *mean)], *mean))


def _typical(
    centers: FloatArray, sizes: FloatArray, box_center: FloatArray, box_size: FloatArray
) -> int:
    """The one of N objects with (N, P, 3) part boxes that is nearest to the mean."""
    offset = np.abs(centers - box_center) / box_size
    return int(np.argmin((np.abs(np.log(sizes / box_size)) + offset).sum(axis=(1, 2))))


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


def shape_basis(
    centers: FloatArray, sizes: FloatArray, box_center: FloatArray, box_size: FloatArray
) -> FloatArray:
    """(K, P, 6) principal components of how instances differ from the mean boxes.

    Args:
        centers: (N, P, 3) box centres of N instances (m) ...
        sizes: ... and their extents.
        box_center: (P, 3) of the mean object ...
        box_size: ... likewise.

    Returns:
        `Category.shape_basis`; shifts count in units of the mean object's diagonal when
        components are ranked. At most `SHAPE_MODES`, and none that is nil.
    """
    log_scale = np.log(sizes / box_size)
    shift = centers - np.exp(log_scale[:, :1]) * box_center
    span = np.array([box_center - box_size / 2, box_center + box_size / 2])
    diagonal = float(np.linalg.norm(np.ptp(span, axis=(0, 1))))
    differences = np.concatenate([log_scale, shift / diagonal], axis=-1)
    _, strength, ways = np.linalg.svd(differences.reshape(len(sizes), -1), full_matrices=False)
    deviation = strength / np.sqrt(len(sizes))
    kept = np.flatnonzero(deviation > 1e-9)[:SHAPE_MODES]
    modes = (deviation[kept, None] * ways[kept]).reshape(len(kept), *differences.shape[1:])
    return modes * np.array([1, 1, 1, diagonal, diagonal, diagonal])


def keypoints_of(points: FloatArray, box_center: FloatArray) -> FloatArray:
    """(P, `KEYPOINTS`, 3) the middle of every part and those of its points that are far apart.

    Args:
        points: (P, M, 3) on the surface of each part (m).
        box_center: (P, 3) likewise.
    """
    return np.stack([_far_apart(p, c) for p, c in zip(points, box_center, strict=True)])


def _far_apart(points: FloatArray, center: FloatArray) -> FloatArray:
    chosen = [center]
    gap = np.linalg.norm(points - center, axis=-1)
    while len(chosen) < KEYPOINTS:
        chosen.append(points[gap.argmax()])
        gap = np.minimum(gap, np.linalg.norm(points - chosen[-1], axis=-1))
    return np.stack(chosen)


def _size_spread(centers: FloatArray, sizes: FloatArray) -> float:
    """Standard deviation of the logarithm of the instances' diagonals at rest."""
    lower, upper = (centers - sizes / 2).min(axis=1), (centers + sizes / 2).max(axis=1)
    return float(np.log(np.linalg.norm(upper - lower, axis=-1)).std())


def _mesh(instance: Instance, box_center: FloatArray, box_size: FloatArray) -> Mesh:
    """An instance stretched into the boxes, as few triangles."""
    mesh = coarse_mesh(instance.parts)
    center, size = instance.part_boxes()
    offset = (mesh.vertices - center[mesh.part]) * (box_size / size)[mesh.part]
    return replace(mesh, vertices=box_center[mesh.part] + offset)


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


def _frontal_area(instances: Sequence[Instance], staging: Staging) -> float:
    """``S_wld`` of Eq. 1 (m²): log-mean, over typical photos, of ``S_bbox z² / (fx fy)``."""
    rng = np.random.default_rng(1)
    logs = [
        np.log(_box_area(rng, instance, staging))
        for instance in map(_outline, instances)
        for _ in range(_VIEWS // len(instances) or 1)
    ]
    return float(np.exp(np.mean(logs)))


def _outline(instance: Instance) -> Instance:
    """The instance with those vertices alone that can touch a box around its image."""
    parts = []
    for part in instance.parts:
        vertices = np.concatenate([s.vertices for s in part])
        with suppress(QhullError):  # a part that is quite flat has no hull
            vertices = vertices[np.sort(ConvexHull(vertices, qhull_options="Qt Pp").vertices)]
        parts.append((replace(part[0], vertices=vertices),))
    return replace(instance, parts=tuple(parts))


def _box_area(rng: np.random.Generator, instance: Instance, staging: Staging) -> float:
    """Area (m²) of the box around one typical view of an instance, at the root's depth."""
    state = staging.sample_joint_state(rng, instance.joints)
    rest = staging.sample_rest(rng, instance.rests)
    vertices = posed_vertices(instance, root_T_part(instance.joints, state)) @ rest.T
    camera, cam_T_world, box = place_object(staging.sample_view(rng), vertices, 256)
    width, height = (box[2:] - box[:2]) / (camera.fx, camera.fy)
    return float(width * height * cam_T_world[2, 3] ** 2)
