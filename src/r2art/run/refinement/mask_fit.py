"""From the network's estimate to one that fits a mask: the network's own, or one the user has.

See docs/silhouettes.md for what `r2art.run.refinement.refine` does with the two.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from r2art.core.errors import InputError, UsageError
from r2art.core.image import ImageLike, Photo, View, crop_square, read_image
from r2art.core.prediction import JointEstimate, PartEstimate, Prediction, Refinement
from r2art.run.refinement.body import Body
from r2art.run.refinement.hidden import hidden
from r2art.run.refinement.pose import Pose, Posed, pose_of, posed
from r2art.run.refinement.refine import refine
from r2art.run.refinement.uncertainty import Uncertainty

FloatArray = NDArray[np.floating]

STEPS = 6
"""Steps by default."""
SIDE = 80
"""Side (px) to which the network's own masks are brought."""
SHARPNESS = 3.0
"""Factor on their logits there: places are coarse, and so soften what is sharp."""
SURE_BAND = 0.3
"""Width, in places, of the unsure band along the outline of a mask that the network is sure of."""
GIVEN_SIDE = 224
"""Side (px) of the window of a user's mask."""
INSIDE = 200
"""Of 255: what is darker in a white photo's window is beyond the photo."""

# Of the network's estimate and of a mask that it is sure of; chosen on rendered validation photos.
OF_NETWORK = Uncertainty(
    rotation=0.16, place=0.02, log_depth=0.08, joint=0.14, outline=0.009, log_scale=0.08
)
# Of the same against a mask that somebody has looked at.
OF_GIVEN = Uncertainty(
    rotation=0.16, place=0.02, log_depth=0.08, joint=0.14, outline=0.01, log_scale=0.08
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Target:
    """What an estimate is fitted to.

    Attributes:
        mask: (H, W) of the whole object, in [0, 1].
        known: (H, W) 0 where the window leaves the photo, else 1.
        K: (3, 3) intrinsics of the window.
        uncertainty: Of the estimate and of this mask.
        whole: Whether the mask shows also what something else hides.
    """

    mask: FloatArray
    known: FloatArray
    K: FloatArray
    uncertainty: Uncertainty
    whole: bool


def own_target(object_mask: FloatArray, view: View, photo: Photo) -> Target:
    """Where the network sees the object, brought to a size whose outline can be followed.

    Args:
        object_mask: (h, w) share of each place in the crop that shows the object.
        view: The crop ...
        photo: ... and what it was cut from.
    """
    share = np.clip(object_mask, 1e-4, 1 - 1e-4).astype(np.float32)
    logits = Image.fromarray(np.log(share / (1 - share)))
    large = np.asarray(logits.resize((SIDE, SIDE), Image.Resampling.BICUBIC), float)
    mask = 1 / (1 + np.exp(-SHARPNESS * large))
    at = (np.arange(SIDE) + 0.5) / SIDE * view.pixels.shape[0] / view.scale
    x, y = at + view.corner[0], at + view.corner[1]
    known = ((y > 0) & (y < photo.height))[:, None] & ((x > 0) & (x < photo.width))
    camera = view.camera.resize(SIDE, SIDE)
    return Target(
        mask=mask * known,
        known=known.astype(float),
        K=camera.K,
        uncertainty=replace(OF_NETWORK, outline=OF_NETWORK.outline * doubt(object_mask)),
        whole=False,
    )


def doubt(object_mask: FloatArray) -> float:
    """How far a mask of the network's may be off, beside one that it is sure of.

    The shares' spread ``p (1 − p)``, summed over the mask, is the unsure area; over the outline's
    length, the width of the unsure band. Errors grow faster than it: its square was best on
    validation photos, where thin things have bands that are twice as wide.
    """
    p = object_mask.astype(float)
    length = np.hypot(*np.gradient(p)).sum()
    band = (p * (1 - p)).sum() / max(length, 1e-6)
    return float(np.clip(band / SURE_BAND, 0.5, 10.0) ** 2)


def given_target(mask: Photo, prediction: Prediction, margin: float) -> Target:
    """A user's mask, cut to a window round the object's box."""
    window = (prediction.camera, prediction.box, GIVEN_SIDE, margin)
    view = crop_square(mask.pixels, *window)
    inside = crop_square(np.full_like(mask.pixels, 255), *window).pixels[..., 0] > INSIDE
    seen = view.pixels[..., 0] / 255.0 * inside
    return Target(
        mask=seen, known=inside.astype(float), K=view.camera.K, uncertainty=OF_GIVEN, whole=True
    )


def read_mask(source: ImageLike, photo: Photo) -> Photo:
    """A mask of the whole object in a photo: white where it is, black elsewhere.

    Raises:
        InputError: It is unreadable, of another size than the photo, or shows nothing.
    """
    mask = read_image(source)
    if (mask.width, mask.height) != (photo.width, photo.height):
        raise InputError(
            f"the mask has {mask.width}×{mask.height} px, the photo (upright) "
            f"{photo.width}×{photo.height}; give a mask of the photo's size"
        )
    if not (mask.pixels[..., 0] > 127).any():
        raise InputError("the mask is black all over; it must be white where the object is seen")
    return mask


def box_of(mask: Photo) -> tuple[float, float, float, float]:
    """x1 y1 x2 y2 (px) around what a mask shows."""
    y, x = np.nonzero(mask.pixels[..., 0] > 127)
    return float(x.min()), float(y.min()), float(x.max() + 1), float(y.max() + 1)


def check_steps(steps: int) -> None:
    """Refuse a number of steps that cannot be meant.

    Raises:
        UsageError: It is negative.
    """
    if steps < 0:
        raise UsageError(f"refinement takes 0 steps (none) or more, got {steps}")


def fitted(
    prediction: Prediction, bodies: Sequence[Body], target: Target, steps: int
) -> Prediction:
    """The prediction, moved until it fits.

    Args:
        prediction: The network's.
        bodies: The category's mean object, see `r2art.run.refinement.refine.resolutions`.
        target: What to fit.
        steps: Most steps on the coarse silhouette; half as many come before, along the outline,
            and a third as many after, on the finer one.
    """
    center = np.array([part.box_center for part in prediction.parts])
    size = np.array([part.box_size for part in prediction.parts])
    own = [body.stretched(center, size) for body in bodies]
    state = np.array([joint.state for joint in prediction.joints])
    cam_T_root = prediction.parts[0].cam_T_part
    known = target.known
    if not target.whole:
        at = posed(own[0], pose_of(own[0], cam_T_root, state))
        known = known * ~hidden(own[0], at, target.mask, target.K)
    found = refine(
        own,
        cam_T_root,
        state,
        target.mask,
        target.K,
        known=known,
        uncertainty=target.uncertainty,
        starts=1,
        steps=(2, steps // 2, steps, steps // 3, 0),
    )
    pose = replace(
        pose_of(own[0], found.cam_T_root, found.joint_state), log_scale=found.log_scale[None]
    )
    how = Refinement(
        steps=found.steps,
        start_residual=found.start_residual,
        residual=found.residual,
        converged=found.converged,
    )
    return with_pose(prediction, own[0], pose, how)


def with_pose(prediction: Prediction, body: Body, pose: Pose, how: Refinement) -> Prediction:
    """The prediction, as refinement has left it.

    Args:
        prediction: The network's.
        body: Its object, of the predicted sizes.
        pose: Where it is now; of one start.
        how: It came there.
    """
    at = posed(body, pose)
    scale = np.exp(pose.log_scale[0])
    center = scale[0] * body.center
    parts = zip(prediction.parts, scale, center, strict=True)
    return replace(
        prediction,
        parts=tuple(_part(part, at, p, s, c) for p, (part, s, c) in enumerate(parts)),
        joints=tuple(
            _joint(joint, at, j, float(pose.joint_state[0, j]))
            for j, joint in enumerate(prediction.joints)
        ),
        refinement=how,
    )


def _part(
    part: PartEstimate, at: Posed, p: int, scale: FloatArray, center: FloatArray
) -> PartEstimate:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = at.rotation[0, p], at.translation[0, p]
    return replace(part, cam_T_part=pose, box_center=center, box_size=scale * part.box_size)


def _joint(joint: JointEstimate, at: Posed, j: int, state: float) -> JointEstimate:
    return replace(joint, state=state, axis=at.axis[0, j], pivot=at.pivot[0, j])
