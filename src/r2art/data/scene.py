"""From an object to a labelled photo: joint states, viewpoint, surroundings, picture.

`make_sample` is the whole flow. A sample depends on nothing but its arguments, so any of
them can be made again, anywhere, to the byte.
"""

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.data import surroundings as world
from r2art.data.pose import posed_vertices, root_T_part, transformed
from r2art.data.render import GAMMA, Frame, Scene, render, render_labels
from r2art.data.sample import BACKDROP, Sample
from r2art.data.shape import Instance, Surface
from r2art.data.staging import Staging, place_object
from r2art.data.surroundings import Surroundings

FloatArray = NDArray[np.floating]


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
    rng: np.random.Generator,
    instance: Instance,
    staging: Staging,
    files: Surroundings,
    size: int = 256,
) -> Sample:
    """Pose, surround, light and photograph an object.

    Args:
        rng: Decides everything that is not given.
        instance: The object.
        staging: How such objects are photographed.
        files: Pictures to draw from.
        size: Side (px) of the square photo.
    """
    joint_state = staging.sample_joint_state(rng, instance.joints)
    world_T_part = root_T_part(instance.joints, joint_state)
    world_T_part[:, :3] = staging.sample_rest(rng, instance.rests) @ world_T_part[:, :3]
    in_world = posed_vertices(instance, world_T_part)
    camera, cam_T_world, box = place_object(staging.sample_view(rng), in_world, size)
    cam_T_part = cam_T_world @ world_T_part
    parts = [
        [transformed(s, T) for s in part]
        for part, T in zip(instance.parts, cam_T_part, strict=True)
    ]
    around, hidden_by = _surround(rng, in_world, cam_T_world, files)
    frame, shows_sky = _photograph(rng, parts, [*around, *hidden_by], cam_T_world, camera, files)
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
    rng: np.random.Generator, in_world: FloatArray, cam_T_world: FloatArray, files: Surroundings
) -> tuple[list[Surface], list[Surface]]:
    lower, upper = in_world.min(axis=0), in_world.max(axis=0)
    around: list[Surface] = []
    if rng.random() < 0.55:
        around += world.ground(rng, lower, upper, files)
        if rng.random() < 0.5:
            around += world.clutter(rng, lower, upper, files)
    in_camera = in_world @ cam_T_world[:3, :3].T + cam_T_world[:3, 3]
    return [transformed(s, cam_T_world) for s in around], occluders(rng, in_camera, files)


def _photograph(
    rng: np.random.Generator,
    parts: list[list[Surface]],
    others: list[Surface],
    cam_T_world: FloatArray,
    camera: Camera,
    files: Surroundings,
) -> tuple[Frame, bool]:
    sky, is_backdrop = world.environment(rng, files.probes)
    scene = Scene(
        surfaces=[s for part in parts for s in part] + others,
        labels=[k + 1 for k, part in enumerate(parts) for _ in part] + [0] * len(others),
        lights=world.lights(rng, cam_T_world[:3, :3]),
        environment=sky,
        world_R_cam=cam_T_world[:3, :3].T,
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
