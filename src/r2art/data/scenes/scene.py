"""From an object to a labelled photo: joint states, viewpoint, surroundings, picture.

`make_sample` is the whole flow. A sample depends on nothing but its arguments, so any of
them can be made again, anywhere, to the byte.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.data.pose import posed_vertices, root_T_part, transformed
from r2art.data.rendering.camera_effects import developed
from r2art.data.rendering.render import Frame, Scene, render, render_silhouettes
from r2art.data.sample import BACKDROP, Sample
from r2art.data.scenes import rooms, sky
from r2art.data.scenes import surroundings as world
from r2art.data.scenes.surroundings import Surroundings
from r2art.data.shape import Instance, Surface
from r2art.data.staging import Staging, place_object

FloatArray = NDArray[np.floating]

LEAST_SEEN = 0.3
"""Share of the object in the picture that must be seen past what stands before it."""
TRIES = 4
"""Surroundings that are tried for it; then the object is photographed alone."""


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


class Arrange(Protocol):
    """Whatever decides what stands round and before an object."""

    def __call__(
        self,
        rng: np.random.Generator,
        parts: Sequence[Sequence[Surface]],
        around: Sequence[Surface],
        camera: Camera,
        files: Surroundings,
        /,
    ) -> list[Surface]:
        """All that is seen beside the object: of ``around``, and more (all in the camera frame)."""
        ...


def make_sample(
    rng: np.random.Generator,
    instance: Instance,
    staging: Staging,
    files: Surroundings,
    size: int = 256,
    arrange: Arrange | None = None,
) -> Sample:
    """Pose, surround, light and photograph an object.

    Args:
        rng: Decides everything that is not given.
        instance: The object.
        staging: How such objects are photographed.
        files: Pictures to draw from.
        size: Side (px) of the square photo.
        arrange: Decides in the end what else stands there, with random numbers of its own: the
            photo of the object stays the same.
    """
    joint_state = staging.sample_joint_state(rng, instance.joints)
    world_T_part = root_T_part(instance.joints, joint_state)
    world_T_part[:, :3] = staging.sample_rest(rng, instance.rests) @ world_T_part[:, :3]
    in_world = posed_vertices(instance, world_T_part)
    view = staging.sample_view(rng)
    camera, cam_T_world, _ = place_object(view, _outermost(in_world), size)
    pixels = camera.project(in_world @ cam_T_world[:3, :3].T + cam_T_world[:3, 3])
    cam_T_part = cam_T_world @ world_T_part
    parts = [
        [transformed(s, T) for s in part]
        for part, T in zip(instance.parts, cam_T_part, strict=True)
    ]
    amodal = render_silhouettes(parts, camera)
    least = LEAST_SEEN * np.count_nonzero(amodal)
    for _ in range(TRIES):
        around, hidden_by = _surround(rng, in_world, cam_T_world, files)
        others = [*around, *hidden_by]
        if arrange is not None:
            others = arrange(rng.spawn(1)[0], parts, around, camera, files)
        frame, shows_sky = _photograph(rng, parts, others, cam_T_world, camera, files)
        if arrange is not None or np.count_nonzero(frame.label) >= least:
            break
    else:
        frame, shows_sky = _photograph(rng, parts, [], cam_T_world, camera, files)
    image, mask = _develop(rng, frame, shows_sky, files)
    for k in range(len(parts)):  # an edge may round either way
        amodal |= (mask == k + 1).astype(np.uint16) << np.uint16(k)
    box_center, box_size = instance.part_boxes()
    return Sample(
        image=image,
        mask=mask,
        depth=frame.depth,
        camera=camera,
        box=np.concatenate([pixels.min(axis=0), pixels.max(axis=0)]),
        cam_T_part=cam_T_part,
        joint_state=joint_state,
        box_center=box_center,
        box_size=box_size,
        axis=np.array([j.axis for j in instance.joints]),
        pivot=np.array([j.pivot for j in instance.joints]),
        visible=_visible_share(mask, amodal, len(parts)),
        amodal=amodal,
    )


def _outermost(points: FloatArray, directions: int = 200) -> FloatArray:
    """The (n, 3) points that reach farthest in many directions: enough to aim a camera by."""
    height = (np.arange(directions) + 0.5) / directions * 2 - 1
    turn = np.arange(directions) * np.pi * (3 - np.sqrt(5))
    flat = np.sqrt(1 - height**2)
    sphere = np.stack([flat * np.cos(turn), flat * np.sin(turn), height])
    reach = points.astype(np.float32) @ sphere.astype(np.float32)
    return points[np.unique(reach.argmax(axis=0))]


def _surround(
    rng: np.random.Generator, in_world: FloatArray, cam_T_world: FloatArray, files: Surroundings
) -> tuple[list[Surface], list[Surface]]:
    lower, upper = in_world.min(axis=0), in_world.max(axis=0)
    around: list[Surface] = []
    if rng.random() < 0.55:
        around += rooms.ground(rng, lower, upper, files)
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
    light = sky.some_sky(rng, files.probes)
    scene = Scene(
        surfaces=[s for part in parts for s in part] + others,
        labels=[k + 1 for k, part in enumerate(parts) for _ in part] + [0] * len(others),
        lights=sky.lights(rng, cam_T_world[:3, :3]),
        environment=light.radiance,
        world_R_cam=light.sky_R_world @ cam_T_world[:3, :3].T,
        show_environment=light.is_backdrop and rng.random() < 0.6,
        diffuse=light.diffuse,
    )
    return render(scene, camera, seed=int(rng.integers(2**30))), scene.show_environment


def _develop(
    rng: np.random.Generator, frame: Frame, shows_sky: bool, files: Surroundings
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Exposure, backdrop and camera: radiance to an 8-bit picture and its mask."""
    on_object = frame.label > 0
    seen = frame.rgb[on_object] if on_object.any() else frame.rgb.reshape(-1, 3)
    gain = np.exp(rng.uniform(np.log(0.1), np.log(0.45))) / max(float(seen.mean()), 1e-4)
    rgb = frame.rgb * np.float32(gain)
    mask = frame.label.copy()
    if not shows_sky:
        behind = world.linear(world.backdrop(rng, files.photos, *mask.shape))
        rgb = rgb + (1 - frame.coverage[..., None]) * behind
        mask[frame.coverage == 0] = BACKDROP
    focus = float(np.median(frame.depth[on_object])) if on_object.any() else 1.0
    return developed(rng, rgb, frame.depth, focus), mask


def _visible_share(mask: NDArray[np.uint8], amodal: NDArray[np.uint16], parts: int) -> FloatArray:
    """(P,) seen pixels of each part over those of its silhouette with nothing before it."""
    seen = [np.count_nonzero(mask == k + 1) for k in range(parts)]
    whole = [np.count_nonzero(amodal & np.uint16(1 << k)) for k in range(parts)]
    return np.array(seen) / np.maximum(whole, 1)
