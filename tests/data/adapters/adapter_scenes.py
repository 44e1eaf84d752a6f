"""Small rendered scenes with everything known: what the fixtures of every adapter are made from."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.spatial.transform import Rotation

from r2art.core.camera import Camera
from r2art.core.category import Joint
from r2art.data.categories import make_instance
from r2art.data.procedural.assembly import assembled
from r2art.data.procedural.solids import box
from r2art.data.rendering.render import Light, Scene, render
from r2art.data.shape import Instance, Material, Surface
from r2art.data.staging import View, facing_rotation

WIDTH, HEIGHT = 128, 96


@dataclass(frozen=True, kw_only=True)
class Truth:
    """A photo of an instance, in r2art's conventions, by the renderer."""

    instance: Instance
    joint_state: np.ndarray
    image: np.ndarray
    mask: np.ndarray  # 0 surroundings, k + 1 part k
    depth: np.ndarray
    camera: Camera
    cam_T_part: np.ndarray

    @property
    def box(self) -> list[int]:
        """Of the pixels seen, x2 and y2 beyond them."""
        v, u = np.nonzero(self.mask)
        return [int(u.min()), int(v.min()), int(u.max()) + 1, int(v.max()) + 1]


def moved(instance: Instance, joint_state: np.ndarray) -> np.ndarray:
    """(P, 4, 4) part poses in the root frame; SciPy's rotations, not r2art's."""
    poses = [np.eye(4)]
    for joint, state in zip(instance.joints, joint_state, strict=True):
        poses.append(poses[joint.parent] @ screw(joint.kind, joint.axis, joint.pivot, state))
    return np.stack(poses)


def screw(kind, axis, pivot, state) -> np.ndarray:
    """(4, 4) turn about, or slide along, an axis."""
    T = np.eye(4)
    if kind == "prismatic":
        T[:3, 3] = state * np.asarray(axis)
    else:
        T[:3, :3] = Rotation.from_rotvec(state * np.asarray(axis)).as_matrix()
        T[:3, 3] = pivot - T[:3, :3] @ pivot
    return T


def photograph(
    instance: Instance,
    joint_state: np.ndarray,
    *,
    azimuth: float = 0.5,
    place: tuple[float, float] = (0.01, -0.02),
    backdrop: bool = False,
    width: int = WIDTH,
    height: int = HEIGHT,
) -> Truth:
    """Render an instance before nothing, or before a wall; ``place``: x, y (m) of its middle."""
    view = View(azimuth=azimuth, elevation=0.45, roll=0.06, fov=0.9, fill=0.7, place=(0.5, 0.5))
    camera = Camera(1.1 * width, 1.1 * width, width / 2 + 1.25, height / 2 - 0.75, width, height)
    cam_T_root = np.eye(4)
    cam_T_root[:3, :3] = facing_rotation(view)
    root_T_part = moved(instance, joint_state)
    points = np.concatenate(
        [
            s.vertices @ T[:3, :3].T + T[:3, 3]
            for part, T in zip(instance.parts, root_T_part, strict=True)
            for s in part
        ]
    )
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    far = 1.9 * np.linalg.norm(np.ptp(points, axis=0))
    cam_T_root[:3, 3] = (*place, far) - cam_T_root[:3, :3] @ middle
    cam_T_part = cam_T_root @ root_T_part
    surfaces, labels = [], []
    for k, (part, T) in enumerate(zip(instance.parts, cam_T_part, strict=True)):
        surfaces += [_posed(s, T) for s in part]
        labels += [k + 1] * len(part)
    if backdrop:
        surfaces.append(_wall(2 * far))
        labels.append(0)
    frame = render(
        Scene(
            surfaces=surfaces,
            labels=labels,
            lights=[Light(direction=(0.3, -0.7, -0.65), color=(2.0, 2.0, 1.9))],
            environment=np.full((8, 16, 3), 0.4, np.float32),
            world_R_cam=np.diag([1.0, -1.0, -1.0]),
        ),
        camera,
    )
    image = (255 * np.clip(frame.rgb, 0, 1) ** (1 / 2.2) + 0.5).astype(np.uint8)
    return Truth(
        instance=instance,
        joint_state=np.asarray(joint_state, float),
        image=image,
        mask=frame.label.copy(),
        depth=frame.depth.astype(np.float64),
        camera=camera,
        cam_T_part=cam_T_part,
    )


def _posed(surface: Surface, T: np.ndarray) -> Surface:
    return replace(
        surface,
        vertices=surface.vertices @ T[:3, :3].T + T[:3, 3],
        normals=surface.normals @ T[:3, :3].T,
    )


def _wall(z: float) -> Surface:
    return box((-4 * z, -4 * z, z), (4 * z, 4 * z, z + 0.01), Material(color=(0.5, 0.6, 0.5)))


def together(front: Truth, behind: Truth) -> tuple[Truth, Truth]:
    """Two photos as one, in which the first object hides the second."""
    hidden = front.mask > 0
    image = np.where(hidden[..., None], front.image, behind.image)
    depth = np.where(hidden, front.depth, behind.depth)
    seen = np.where(hidden, 0, behind.mask).astype(np.uint8)
    return (
        replace(front, image=image, depth=depth),
        replace(behind, image=image, depth=depth, mask=seen),
    )


def points_of(instance: Instance, part: int) -> np.ndarray:
    """(N, 3) its vertices, and points inside its triangles, at rest."""
    rng = np.random.default_rng(part)
    corners = np.concatenate([s.vertices[s.faces] for s in instance.parts[part]])
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    chosen = corners[rng.choice(len(corners), 1500, p=area / area.sum())]
    inside = np.einsum("nk,nkd->nd", rng.dirichlet((1, 1, 1), len(chosen)), chosen)
    vertices = np.concatenate([s.vertices for s in instance.parts[part]])
    return np.concatenate([np.unique(vertices, axis=0), inside])


@lru_cache
def laptop(seed: int = 0) -> Instance:
    return make_instance("laptop", seed)


@lru_cache
def drawers(seed: int = 0) -> Instance:
    """Four parts."""
    return make_instance("drawer", seed)


@lru_cache
def one_drawer(seed: int = 0) -> Instance:
    """Two parts: all but the top drawer belong to the cabinet."""
    full = drawers(seed)
    return assembled(
        "drawer",
        {"cabinet": [s for k in (0, 2, 3) for s in full.parts[k]], "drawer": full.parts[1]},
        [full.joints[0]],
    )


@lru_cache
def shears() -> Instance:
    """Two crossing plates on a pivot, told apart by length and colour."""
    first = box((-0.01, -0.002, -0.06), (0.01, 0.002, 0.1), Material(color=(0.8, 0.2, 0.2)))
    second = box((-0.01, 0.002, -0.06), (0.01, 0.006, 0.06), Material(color=(0.2, 0.2, 0.8)))
    hinge = Joint(
        name="pivot",
        kind="revolute",
        parent=0,
        axis=(0.0, 1.0, 0.0),
        pivot=(0.0, 0.002, 0.01),
        limits=(0.0, 1.2),
    )
    return assembled("scissors", {"blade_1": [first], "blade_2": [second]}, [hinge])


def polygons(mask: np.ndarray) -> list[list[float]]:
    """COCO polygons that cover exactly some pixels: one rectangle for each run of a row."""
    found = []
    for y, row in enumerate(mask):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], row.astype(int), [0]])))
        for x1, x2 in edges.reshape(-1, 2).tolist():
            found.append([x1, y, x2, y, x2, y + 1, x1, y + 1])
    return [[float(v) for v in polygon] for polygon in found]


def intrinsics(camera: Camera, shift: float) -> dict:
    """Open3D's JSON of a camera; ``shift`` (px) from our first pixel's centre to theirs."""
    cx, cy = camera.cx - shift, camera.cy - shift
    matrix = [camera.fx, 0, 0, 0, camera.fy, 0, cx, cy, 1]
    return {"width": camera.width, "height": camera.height, "intrinsic_matrix": matrix}


def same(sample, truth: Truth, unit: float = 1.0) -> None:
    """Hold a sample that was read back against the scene it was written from."""
    poses = truth.cam_T_part.copy()
    poses[:, :3, 3] *= unit
    np.testing.assert_allclose(sample.cam_T_part, poses, atol=1e-6)
    joints = truth.instance.joints
    state = truth.joint_state * [1.0 if j.kind == "revolute" else unit for j in joints]
    np.testing.assert_allclose(sample.joint_state, state, atol=1e-6)
    center, size = truth.instance.part_boxes()
    np.testing.assert_allclose(sample.box_center, unit * center, atol=1e-6)
    np.testing.assert_allclose(sample.box_size, unit * size, atol=1e-6)
    np.testing.assert_allclose(sample.axis, [j.axis for j in joints], atol=1e-6)
    for pivot, joint in zip(sample.pivot, joints, strict=True):
        across = pivot - unit * np.asarray(joint.pivot)
        if joint.kind == "revolute":
            np.testing.assert_allclose(np.cross(across, joint.axis), 0, atol=1e-6)
    on_object = truth.mask > 0
    np.testing.assert_array_equal(np.where(sample.mask == 255, 0, sample.mask), truth.mask)
    off = np.abs(sample.depth - unit * truth.depth)[on_object]
    assert off.max() <= unit * 0.51e-3
    assert np.abs(sample.image.astype(int) - truth.image).mean() < 6
    assert (sample.box[:2] <= truth.box[:2]).all()
    assert (sample.box[2:] >= truth.box[2:]).all()


def points_fall_on_masks(sample, instance: Instance, unit: float = 1.0) -> None:
    """Rest points, moved by their part's pose: where they are what is seen, the mask says so."""
    height, width = sample.mask.shape
    near_object = binary_dilation((sample.mask > 0) & (sample.mask < 255), np.ones((3, 3)))
    for part, T in enumerate(sample.cam_T_part):
        points = unit * points_of(instance, part) @ T[:3, :3].T + T[:3, 3]
        u, v = np.floor(sample.camera.project(points)).astype(int).T
        assert (u >= 0).all()
        assert (v >= 0).all()
        assert (u < width).all()
        assert (v < height).all()
        seen = np.abs(sample.depth[v, u] - points[:, 2]) < 0.004 * points[:, 2]
        labels = sample.mask[v, u][seen]
        if len(labels) > 50:
            assert (labels == part + 1).mean() > 0.9
        assert near_object[v, u].mean() > 0.999
        lower = sample.box_center[part] - sample.box_size[part] / 2
        inside = unit * points_of(instance, part) - lower
        assert (inside > -1e-6).all()
        assert (inside < sample.box_size[part] + 1e-6).all()
