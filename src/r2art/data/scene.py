"""From an object to a labelled photo: joint states, viewpoint, surroundings, picture.

`make_sample` is the whole flow. A sample depends on nothing but its arguments, so any of
them can be made again, anywhere, to the byte.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.category import Joint
from r2art.data import surroundings as world
from r2art.data.pose import posed_vertices, root_T_part, transformed
from r2art.data.render import GAMMA, Frame, Scene, render, render_labels
from r2art.data.sample import BACKDROP, Sample
from r2art.data.shape import Instance, Surface
from r2art.data.surroundings import Surroundings

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class View:
    """Where a photo is taken from (angles in radians).

    Attributes:
        azimuth: Of the camera round the object; 0 looks at its front, positive from its right.
        elevation: Of the camera above the object's horizon.
        roll: Of the camera about its viewing ray.
        fov: Field of view of the longer image side.
        fill: Longer side of the object's box over the image side.
        place: Where in the room left over the box lies, each in [0, 1].
    """

    azimuth: float
    elevation: float
    roll: float
    fov: float
    fill: float
    place: tuple[float, float]


def sample_view(rng: np.random.Generator) -> View:
    """A viewpoint as people take photos: mostly from the front, a little above, nearly level."""
    azimuth = float(np.clip(rng.normal(0, np.radians(38)), -np.radians(110), np.radians(110)))
    elevation = float(np.clip(rng.normal(np.radians(25), np.radians(14)), -0.15, 1.3))
    roll = float(rng.normal(0, np.radians(4 if rng.random() < 0.7 else 18)))
    low, high = [(25, 40), (40, 65), (65, 90)][rng.choice(3, p=[0.3, 0.5, 0.2])]
    cut = rng.random() < 0.08
    return View(
        azimuth=azimuth,
        elevation=elevation,
        roll=roll,
        fov=float(np.radians(rng.uniform(low, high))),
        fill=float(rng.uniform(0.8, 1.1) if cut else rng.uniform(0.35, 0.97)),
        place=(float(rng.uniform(-0.4, 1.4) if cut else rng.random()), float(rng.random())),
    )


def sample_joint_state(rng: np.random.Generator, joints: tuple[Joint, ...]) -> FloatArray:
    """(J,) states within limits: hinges mostly well open, slides often shut."""
    share = np.empty(len(joints))
    for j, joint in enumerate(joints):
        if joint.kind == "revolute":
            share[j] = rng.beta(7, 2.5) if rng.random() < 0.75 else rng.random()
        else:
            share[j] = 0.0 if rng.random() < 0.35 else rng.random()
    limits = np.array([joint.limits for joint in joints])
    return limits[:, 0] + share * (limits[:, 1] - limits[:, 0])


def _about(axis: int, angle: float) -> FloatArray:
    R = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[[i, j], [i, j]] = np.cos(angle)
    R[j, i], R[i, j] = np.sin(angle), -np.sin(angle)
    return R


def facing_rotation(view: View) -> FloatArray:
    """(3, 3) rotation of the root, seen from a camera that looks straight at it."""
    to_opencv = np.diag([1.0, -1.0, -1.0])
    return _about(2, view.roll) @ _about(0, view.elevation) @ to_opencv @ _about(1, -view.azimuth)


def _rotation_to(ray: FloatArray) -> FloatArray:
    """(3, 3) minimal rotation taking (0, 0, 1) to the unit ``ray``."""
    x, y, z = ray
    K = np.array([[0, 0, x], [0, 0, y], [-x, -y, 0]])
    return np.eye(3) + K + K @ K / (1 + z)


def place_object(
    view: View, vertices: FloatArray, size: int
) -> tuple[Camera, FloatArray, FloatArray]:
    """Stand the camera so that the object fills the image as the view asks.

    Args:
        view: The viewpoint.
        vertices: (V, 3) of the posed object, in the root frame.
        size: Side (px) of the square image.

    Returns:
        The camera, ``cam_T_root`` (4, 4) and the 2D box (4,) of the object.
    """
    camera = Camera.from_fov(view.fov, size, size)
    R_facing = facing_rotation(view)
    center = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    radius = float(np.linalg.norm(vertices - center, axis=1).max())
    distance = 2 * radius * camera.fx / (view.fill * size)
    pixel = np.array([size / 2, size / 2])
    cam_T_root, box = np.eye(4), np.zeros(4)
    for _ in range(8):
        ray = np.array([*((pixel - (camera.cx, camera.cy)) / camera.fx), 1.0])
        ray /= np.linalg.norm(ray)
        R = _rotation_to(ray) @ R_facing
        distance = max(distance, 1.15 * radius)
        cam_T_root = np.eye(4)
        cam_T_root[:3, :3] = R
        cam_T_root[:3, 3] = distance * ray - R @ center
        points = vertices @ R.T + cam_T_root[:3, 3]
        points = points[points[:, 2] > 0.02 * radius]
        uv = camera.project(points)
        box = np.concatenate([uv.min(axis=0), uv.max(axis=0)])
        extent = box[2:] - box[:2]
        wanted = extent / 2 + np.array(view.place) * np.maximum(size - extent, 0)
        if np.any(extent > size):
            wanted = np.where(extent > size, size / 2, wanted)
        pixel = np.clip(pixel + wanted - (box[:2] + box[2:]) / 2, 0, size)
        distance *= float(extent.max()) / (view.fill * size)
    return camera, cam_T_root, box


def occluders(rng: np.random.Generator, points: FloatArray, files: Surroundings) -> list[Surface]:
    """Sometimes one thing between camera and object, hiding a piece of it (camera frame)."""
    if rng.random() > 0.25:
        return []
    target = points[rng.integers(len(points))]
    near = rng.uniform(0.5, 0.85)
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    extent = near * float(np.linalg.norm(np.ptp(points, axis=0))) * rng.uniform(0.1, 0.35)
    away = (target - center) * rng.uniform(0.3, 0.9)
    return [world.thing(rng, (target + away) * near, extent, files)]


def make_sample(
    rng: np.random.Generator, instance: Instance, files: Surroundings, size: int = 256
) -> Sample:
    """Pose, surround, light and photograph an object.

    Args:
        rng: Decides everything that is not given.
        instance: The object.
        files: Pictures to draw from.
        size: Side (px) of the square photo.
    """
    joint_state = sample_joint_state(rng, instance.joints)
    root_T_parts = root_T_part(instance.joints, joint_state)
    view = sample_view(rng)
    in_root = posed_vertices(instance, root_T_parts)
    camera, cam_T_root, box = place_object(view, in_root, size)
    cam_T_part = cam_T_root @ root_T_parts
    parts = [
        [transformed(s, T) for s in part]
        for part, T in zip(instance.parts, cam_T_part, strict=True)
    ]
    around, hidden_by = _surround(rng, in_root, cam_T_root, files)
    frame, shows_sky = _photograph(rng, parts, [*around, *hidden_by], cam_T_root, camera, files)
    image, mask = _develop(rng, frame, shows_sky, files)
    box_center, box_size = instance.part_boxes()
    return Sample(
        image=image,
        mask=mask,
        depth=frame.depth,
        camera=camera,
        box=box,
        cam_T_part=cam_T_part,
        joint_state=joint_state,
        box_center=box_center,
        box_size=box_size,
        axis=np.array([j.axis for j in instance.joints]),
        pivot=np.array([j.pivot for j in instance.joints]),
        visible=_visible_share(parts, frame.label, camera),
    )


def _surround(
    rng: np.random.Generator, in_root: FloatArray, cam_T_root: FloatArray, files: Surroundings
) -> tuple[list[Surface], list[Surface]]:
    lower, upper = in_root.min(axis=0), in_root.max(axis=0)
    around: list[Surface] = []
    if rng.random() < 0.55:
        around += world.ground(rng, lower, upper, files)
        if rng.random() < 0.5:
            around += world.clutter(rng, lower, upper, files)
    in_camera = in_root @ cam_T_root[:3, :3].T + cam_T_root[:3, 3]
    return [transformed(s, cam_T_root) for s in around], occluders(rng, in_camera, files)


def _photograph(
    rng: np.random.Generator,
    parts: list[list[Surface]],
    others: list[Surface],
    cam_T_root: FloatArray,
    camera: Camera,
    files: Surroundings,
) -> tuple[Frame, bool]:
    sky, is_backdrop = world.environment(rng, files.probes)
    scene = Scene(
        surfaces=[s for part in parts for s in part] + others,
        labels=[k + 1 for k, part in enumerate(parts) for _ in part] + [0] * len(others),
        lights=world.lights(rng, cam_T_root[:3, :3]),
        environment=sky,
        world_R_cam=cam_T_root[:3, :3].T,
        show_environment=is_backdrop and rng.random() < 0.6,
    )
    return render(scene, camera, seed=int(rng.integers(2**30))), scene.show_environment


def _develop(
    rng: np.random.Generator, frame: Frame, shows_sky: bool, files: Surroundings
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Exposure, backdrop and tone curve: radiance to an 8-bit picture and its mask."""
    on_object = frame.label > 0
    seen = frame.rgb[on_object] if on_object.any() else frame.rgb.reshape(-1, 3)
    gain = np.exp(rng.uniform(np.log(0.1), np.log(0.45))) / max(float(seen.mean()), 1e-4)
    rgb = frame.rgb * gain
    mask = frame.label.copy()
    if not shows_sky:
        behind = world.linear(world.backdrop(rng, files.photos, *mask.shape))
        rgb = rgb + (1 - frame.coverage[..., None]) * behind
        mask[frame.coverage == 0] = BACKDROP
    picture = np.clip(rgb, 0, 1) ** (1 / GAMMA)
    return (255 * picture + 0.5).astype(np.uint8), mask


def _visible_share(
    parts: list[list[Surface]], seen: NDArray[np.uint8], camera: Camera, coarse: int = 4
) -> FloatArray:
    """(P,) seen pixels of each part over those of its silhouette with nothing before it.

    The whole silhouettes are traced ``coarse`` times coarser; their areas are what counts.
    """
    small = camera.resize(camera.width // coarse, camera.height // coarse)
    share = np.zeros(len(parts))
    for k, part in enumerate(parts):
        alone = coarse**2 * np.count_nonzero(render_labels(part, [1] * len(part), small))
        share[k] = min(1.0, np.count_nonzero(seen == k + 1) / alone) if alone else 0.0
    return share
