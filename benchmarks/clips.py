"""Rendered clips with known truth: one object in one fixed scene, its joints opening smoothly.

The hand that holds the camera sways a little; light, surroundings and object stay. Every frame has
its own noise of rays and sensor, and its own exposure, as automatic cameras have.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.data.objects import Procedural, Split, instance_seed
from r2art.data.pose import posed_vertices, root_T_part, transformed
from r2art.data.rendering.render import GAMMA, Frame, Scene, render
from r2art.data.scenes import rooms, sky
from r2art.data.scenes import surroundings as world
from r2art.data.scenes.surroundings import Surroundings
from r2art.data.shape import Instance, Surface
from r2art.data.staging import View, about, place_object

FloatArray = NDArray[np.floating]

FPS = 30.0
REST = 0.15
"""Share of a clip in which the joints rest, at its beginning and at its end."""
NOISE = 0.012
"""Standard deviation of the sensor's noise; 1 is white."""
FILL = 0.62
"""Longer side of the object's box over the height of the picture, half open."""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What is true in one frame.

    Attributes:
        time: s.
        cam_T_part: (P, 4, 4) m.
        joint_state: (J,) rad or m.
        diagonal: Of the root part's box (m).
    """

    time: float
    cam_T_part: FloatArray
    joint_state: FloatArray
    diagonal: float


@dataclass(frozen=True, kw_only=True)
class Clip:
    """A clip: what it shows can be rendered frame by frame.

    Attributes:
        camera: Of all frames.
        truth: Of each frame.
    """

    camera: Camera
    truth: tuple[Truth, ...]
    instance: Instance
    world_T_cam: tuple[FloatArray, ...]
    seed: tuple[int, ...]

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        """(H, W, 3) uint8 of each frame."""
        for k in range(len(self.truth)):
            yield _picture(self, k)


def opening(t: FloatArray) -> FloatArray:
    """Share of the way from closed to open at times from 0 to 1: at rest, a smooth move, at rest.

    The move is the one of least jerk (Flash and Hogan 1985), as a hand makes it.
    """
    s = np.clip((t - REST) / (1 - 2 * REST), 0, 1)
    return s**3 * (10 - 15 * s + 6 * s**2)


def make_clip(
    category: str, split: Split, seed: int, count: int, size: tuple[int, int] = (320, 240)
) -> Clip:
    """A clip of ``count`` frames of object ``seed``; it depends on nothing else."""
    instance = Procedural(category).instance(instance_seed(category, split, 77, seed))
    rng = np.random.default_rng([seed, 5])
    limits = np.array([joint.limits for joint in instance.joints])
    first, last = rng.uniform(0.08, 0.25, len(limits)), rng.uniform(0.6, 0.85, len(limits))
    share = first + (last - first) * opening(np.linspace(0, 1, count))[:, None]
    states = limits[:, 0] + share * (limits[:, 1] - limits[:, 0])

    staging = Procedural(category).staging
    view = View(
        azimuth=staging.sample_view(rng).azimuth,
        elevation=float(rng.uniform(0.25, 0.8)),
        roll=0.0,
        fov=0.9,
        fill=FILL,
        place=(0.5, 0.5),
    )
    middle = posed_vertices(instance, root_T_part(instance.joints, states[count // 2]))
    width, height = size
    square, cam_T_world, _ = place_object(view, middle, height)
    camera = square.crop((height - width) / 2, 0, width, height)
    distance = float(np.linalg.norm(cam_T_world[:3, 3]))
    sway = [_sway(rng, count) * scale for scale in (*[0.012] * 3, *[0.01 * distance] * 3)]
    poses = [_swayed(cam_T_world, np.array(s)) for s in zip(*sway, strict=True)]
    diagonal = float(np.linalg.norm(instance.part_boxes()[1][0]))
    truth = tuple(
        Truth(
            time=k / FPS,
            cam_T_part=pose @ root_T_part(instance.joints, states[k]),
            joint_state=states[k],
            diagonal=diagonal,
        )
        for k, pose in enumerate(poses)
    )
    return Clip(
        camera=camera,
        truth=truth,
        instance=instance,
        world_T_cam=tuple(np.linalg.inv(pose) for pose in poses),
        seed=(seed, 6),
    )


def _sway(rng: np.random.Generator, count: int) -> FloatArray:
    """(count,) a slow, smooth motion of about unit size."""
    t = np.arange(count) / FPS
    slow, fast = rng.uniform(0.2, 0.5), rng.uniform(0.7, 1.3)
    a, b = rng.uniform(0, 2 * np.pi, 2)
    return np.sin(2 * np.pi * slow * t + a) + 0.4 * np.sin(2 * np.pi * fast * t + b)


def _swayed(cam_T_world: FloatArray, sway: FloatArray) -> FloatArray:
    motion = np.eye(4)
    motion[:3, :3] = about(0, sway[0]) @ about(1, sway[1]) @ about(2, sway[2])
    motion[:3, 3] = sway[3:]
    return motion @ cam_T_world


def _picture(clip: Clip, k: int) -> NDArray[np.uint8]:
    """The same random numbers in every frame make the same scene; only rays and noise differ."""
    rng = np.random.default_rng(clip.seed)
    frame_rng = np.random.default_rng([*clip.seed, k])
    files = Surroundings()
    rest = posed_vertices(
        clip.instance, root_T_part(clip.instance.joints, clip.truth[0].joint_state)
    )
    around = rooms.floor(rng, rest.min(axis=0), rest.max(axis=0), files)
    around += world.clutter(rng, rest.min(axis=0), rest.max(axis=0), files)
    cam_T_world = np.linalg.inv(clip.world_T_cam[k])
    frame = _traced(rng, clip, k, [transformed(s, cam_T_world) for s in around], frame_rng)
    gain = np.exp(rng.uniform(np.log(0.15), np.log(0.4))) / max(float(frame.rgb.mean()), 1e-4)
    behind = world.linear(world.backdrop(rng, (), clip.camera.height, clip.camera.width))
    rgb = frame.rgb * np.float32(gain) + (1 - frame.coverage[..., None]) * behind
    rgb = rgb + NOISE * frame_rng.standard_normal(rgb.shape, dtype=np.float32)
    return (255 * np.clip(rgb, 0, 1) ** (1 / GAMMA) + 0.5).astype(np.uint8)


def _traced(
    rng: np.random.Generator,
    clip: Clip,
    k: int,
    others: list[Surface],
    frame_rng: np.random.Generator,
) -> Frame:
    truth = clip.truth[k]
    cam_R_world = clip.world_T_cam[k][:3, :3].T
    light = sky.some_sky(rng, ())
    parts = [
        [transformed(s, T) for s in part]
        for part, T in zip(clip.instance.parts, truth.cam_T_part, strict=True)
    ]
    scene = Scene(
        surfaces=[s for part in parts for s in part] + others,
        labels=[p + 1 for p, part in enumerate(parts) for _ in part] + [0] * len(others),
        lights=sky.lights(rng, cam_R_world),
        environment=light.radiance,
        world_R_cam=light.sky_R_world @ cam_R_world.T,
        show_environment=False,
        diffuse=light.diffuse,
    )
    return render(scene, clip.camera, seed=int(frame_rng.integers(2**30)))
