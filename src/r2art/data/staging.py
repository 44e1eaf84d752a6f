"""How an object stands and from where it is photographed."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.core.category import Joint
from r2art.core.errors import UsageError

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Spread:
    """How far open photos show a joint: its share of the range from closed to open.

    Attributes:
        closed: Probability that it is quite shut ...
        opened: ... and that it is open as far as it goes.
        typical: Otherwise, probability that the share is drawn from ``beta``, not uniformly.
        beta: Parameters of that Beta distribution.
    """

    closed: float = 0.0
    opened: float = 0.0
    typical: float = 0.0
    beta: tuple[float, float] = (1.0, 1.0)

    def sample(self, rng: np.random.Generator) -> float:
        """A share in [0, 1]."""
        kind = rng.random()
        if kind < self.closed:
            return 0.0
        if kind < self.closed + self.opened:
            return 1.0
        return float(rng.beta(*self.beta) if rng.random() < self.typical else rng.random())


HINGE = Spread(typical=0.75, beta=(7.0, 2.5))
"""Mostly well open."""
SLIDE = Spread(closed=0.35)
"""Often shut."""


@dataclass(frozen=True, kw_only=True)
class Rest:
    """A way in which an object rests on the ground: the root frame turned about one axis.

    Attributes:
        weight: How often, relative to the other ways.
        axis: Axis of the world (x right, y up, z front) about which the object is turned ...
        angle: ... and how far (rad).
    """

    weight: float = 1.0
    axis: Literal["x", "y", "z"] = "y"
    angle: float = 0.0

    def rotation(self) -> FloatArray:
        """(3, 3) ``world_R_root``."""
        return about("xyz".index(self.axis), self.angle)


UPRIGHT = Rest()


@dataclass(frozen=True, kw_only=True)
class Framing:
    """What a benchmark holds fixed of every view, whatever people do.

    Attributes:
        fov: Field of view (rad) of every photo; None: several.
        whole: Whether no photo cuts the object off.
        beyond: Share of the object's box that lies beyond one edge of the photo, 0 to 0.9; 0
            touches it. Which edge does not depend on the share. None: as it comes.
    """

    fov: float | None = None
    whole: bool = False
    beyond: float | None = None

    def __post_init__(self) -> None:
        if self.beyond is not None and not 0 <= self.beyond <= 0.9:
            raise UsageError(f"the share of a box beyond an edge is 0 to 0.9, got {self.beyond}")


LARGEST_WHOLE = 0.9
"""Longest side of the box of an object that is not to be cut off, over the image side."""


@dataclass(frozen=True, kw_only=True)
class Staging:
    """How people photograph the objects of a category (angles in radians).

    Attributes:
        azimuth: Standard deviation of the camera's azimuth about the object's front; None: from
            all around alike.
        azimuth_limit: Greatest azimuth to either side.
        elevation: Mean and standard deviation of the camera's elevation ...
        elevation_limits: ... and its least and greatest value.
        joints: By joint name, how far open it is; others as `HINGE` or `SLIDE`.
        together: Probability that all joints take the share of the first.
        rests: Ways in which it may lie on the ground; the first is upright.
        framing: What is the same on all photos.
    """

    azimuth: float | None = float(np.radians(38))
    azimuth_limit: float = float(np.radians(110))
    elevation: tuple[float, float] = (float(np.radians(25)), float(np.radians(14)))
    elevation_limits: tuple[float, float] = (-0.15, 1.3)
    joints: Mapping[str, Spread] = field(default_factory=dict)
    together: float = 0.0
    rests: tuple[Rest, ...] = (UPRIGHT,)
    framing: Framing = Framing()

    def sample_view(self, rng: np.random.Generator) -> "View":
        """A viewpoint as people take photos of such objects."""
        if self.azimuth is None:
            azimuth = float(rng.uniform(-np.pi, np.pi))
        else:
            limit = self.azimuth_limit
            azimuth = float(np.clip(rng.normal(0, self.azimuth), -limit, limit))
        elevation = float(np.clip(rng.normal(*self.elevation), *self.elevation_limits))
        roll = float(rng.normal(0, np.radians(4 if rng.random() < 0.7 else 18)))
        low, high = [(25, 40), (40, 65), (65, 90)][rng.choice(3, p=[0.3, 0.5, 0.2])]
        cut = rng.random() < 0.08
        view = View(
            azimuth=azimuth,
            elevation=elevation,
            roll=roll,
            fov=float(np.radians(rng.uniform(low, high))),
            fill=float(rng.uniform(0.8, 1.1) if cut else rng.uniform(0.35, 0.97)),
            place=(float(rng.uniform(-0.4, 1.4) if cut else rng.random()), float(rng.random())),
        )
        return _framed(rng, view, self.framing)

    def sample_joint_state(self, rng: np.random.Generator, joints: tuple[Joint, ...]) -> FloatArray:
        """(J,) joint states within limits."""
        default = {"revolute": HINGE, "prismatic": SLIDE}
        share = np.array([self.joints.get(j.name, default[j.kind]).sample(rng) for j in joints])
        if len(share) > 1 and rng.random() < self.together:
            share[:] = share[0]
        limits = np.array([joint.limits for joint in joints]).reshape(-1, 2)
        return limits[:, 0] + share * (limits[:, 1] - limits[:, 0])

    def sample_rest(self, rng: np.random.Generator, own: tuple[Rest, ...] = ()) -> FloatArray:
        """(3, 3) ``world_R_root`` of a way to rest on the ground: an instance's own, if any."""
        rests = own or self.rests
        weight = np.array([rest.weight for rest in rests])
        return rests[rng.choice(len(weight), p=weight / weight.sum())].rotation()


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
        beyond: How far the box is moved on from there, right and down, in its own extents.
    """

    azimuth: float
    elevation: float
    roll: float
    fov: float
    fill: float
    place: tuple[float, float]
    beyond: tuple[float, float] = (0.0, 0.0)


def _framed(rng: np.random.Generator, view: View, framing: Framing) -> View:
    """The view with what the framing holds fixed; the rest of it stays."""
    if framing.fov is not None:
        view = replace(view, fov=framing.fov)
    if framing.whole or framing.beyond is not None:
        x, y = np.clip(view.place, 0, 1).tolist()
        view = replace(view, fill=min(view.fill, LARGEST_WHOLE), place=(x, y))
    if framing.beyond is not None:
        axis, side = divmod(int(rng.integers(4)), 2)
        place, beyond = list(view.place), [0.0, 0.0]
        place[axis], beyond[axis] = float(side), (2 * side - 1) * framing.beyond
        view = replace(view, place=(place[0], place[1]), beyond=(beyond[0], beyond[1]))
    return view


def about(axis: int, angle: float) -> FloatArray:
    """(3, 3) rotation about axis 0, 1 or 2."""
    R = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[[i, j], [i, j]] = np.cos(angle)
    R[j, i], R[i, j] = np.sin(angle), -np.sin(angle)
    return R


def facing_rotation(view: View) -> FloatArray:
    """(3, 3) rotation of the world, seen from a camera that looks straight at the object."""
    to_opencv = np.diag([1.0, -1.0, -1.0])
    return about(2, view.roll) @ about(0, view.elevation) @ to_opencv @ about(1, -view.azimuth)


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
        vertices: (V, 3) of the posed object, in the world's frame.
        size: Side (px) of the square image.

    Returns:
        The camera, ``cam_T_world`` (4, 4) and the 2D box (4,) of the object.
    """
    camera = Camera.from_fov(view.fov, size, size)
    R_facing = facing_rotation(view)
    center = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    radius = float(np.linalg.norm(vertices - center, axis=1).max())
    distance = 2 * radius * camera.fx / (view.fill * size)
    pixel, reach = np.array([size / 2, size / 2]), size * np.abs(view.beyond)
    cam_T_world, box = np.eye(4), np.zeros(4)
    for k in range(120):
        gain = 0.8 if k < 20 else 0.25  # wide lenses make large objects at an edge swing
        ray = np.array([*((pixel - (camera.cx, camera.cy)) / camera.fx), 1.0])
        ray /= np.linalg.norm(ray)
        R = _rotation_to(ray) @ R_facing
        distance = max(distance, 1.15 * radius)
        cam_T_world = np.eye(4)
        cam_T_world[:3, :3] = R
        cam_T_world[:3, 3] = distance * ray - R @ center
        uv = camera.project(vertices @ R.T + cam_T_world[:3, 3])
        box = np.concatenate([uv.min(axis=0), uv.max(axis=0)])
        extent = box[2:] - box[:2]
        wanted = extent / 2 + np.array(view.place) * np.maximum(size - extent, 0)
        wanted = np.where(extent > size, size / 2, wanted) + extent * view.beyond
        step = wanted - (box[:2] + box[2:]) / 2
        growth = float(extent.max()) / (view.fill * size)
        if np.abs(step).max() < 1e-3 * size and abs(growth - 1) < 1e-3:
            break
        pixel = np.clip(pixel + gain * step, -reach, size + reach)
        distance *= growth**gain
    return camera, cam_T_world, box
