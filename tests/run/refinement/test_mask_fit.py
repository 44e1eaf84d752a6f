"""An estimate moves to where a mask shows the object, and never away from it."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy.spatial import ConvexHull

from r2art.core.camera import Camera
from r2art.core.errors import InputError, UsageError
from r2art.core.image import crop_square, read_image
from r2art.run.refinement.hidden import silhouette
from r2art.run.refinement.mask_fit import fitted, given_target, own_target
from r2art.run.refinement.pose import pose_of, posed
from r2art.run.refinement.refine import resolutions

CAMERA = Camera(300, 300, 160, 120, 320, 240)
BOX = (60, 40, 240, 210)


@pytest.fixture(scope="module", params=["laptop", "drawer"])
def truth(request, predictor, pixels):
    """Some object that the model believes to see, taken for the truth."""
    return predictor.predict(pixels, CAMERA, request.param, BOX, refine=0)


@pytest.fixture(scope="module")
def bodies(truth, predictor):
    return resolutions(predictor.category(truth.category).prior())


def mask_of(prediction) -> np.ndarray:
    """(H, W, 3) white where the part boxes are seen, drawn by their convex hulls."""
    picture = Image.new("RGB", (CAMERA.width, CAMERA.height))
    for part in prediction.parts:
        uv = CAMERA.project(part.corners().reshape(-1, 3))
        hull = uv[ConvexHull(uv).vertices]
        ImageDraw.Draw(picture).polygon([tuple(p) for p in hull], fill="white")
    return np.array(picture)


def off_course(prediction, degrees=6.0, shift=(0.03, -0.02, 0.05)):
    """The prediction with its root turned and displaced, joints as they were."""
    angle = np.radians(degrees)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    root = prediction.parts[0].cam_T_part
    center, z = root[:3, 3], root[2, 3]

    def moved(points):
        return center + (points - center) @ turn.T + z * np.array(shift)

    def moved_pose(T):
        out = T.copy()
        out[:3, :3], out[:3, 3] = turn @ T[:3, :3], moved(T[None, :3, 3])[0]
        return out

    return replace(
        prediction,
        parts=tuple(replace(p, cam_T_part=moved_pose(p.cam_T_part)) for p in prediction.parts),
        joints=tuple(
            replace(j, axis=turn @ j.axis, pivot=moved(j.pivot[None])[0]) for j in prediction.joints
        ),
    )


def distance(prediction, truth) -> float:
    """Mean displacement of all box corners in the photo (px)."""
    pairs = zip(prediction.parts, truth.parts, strict=True)
    uv = [(CAMERA.project(a.corners()), CAMERA.project(b.corners())) for a, b in pairs]
    return float(np.mean([np.linalg.norm(a - b, axis=-1).mean() for a, b in uv]))


def test_it_comes_home(truth, bodies):
    start = off_course(truth)
    target = given_target(read_image(mask_of(truth)), start, 1.25)
    found = fitted(start, bodies, target, 12)
    assert distance(found, truth) < 0.5 * distance(start, truth)
    assert found.refinement is not None
    assert found.refinement.residual < 0.3 * found.refinement.start_residual
    for part in found.parts:
        R = part.cam_T_part[:3, :3]
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-5)  # the model says float32
    for joint in found.joints:
        assert joint.limits[0] - 1e-9 <= joint.state <= joint.limits[1] + 1e-9
        parent, child = found.part(joint.parent), found.part(joint.child)
        if joint.kind == "prismatic":
            apart = child.cam_T_part[:3, 3] - parent.cam_T_part[:3, 3]
            np.testing.assert_allclose(apart, joint.state * joint.axis, atol=1e-5)


def test_what_fits_stays(truth, bodies):
    """But for a mesh whose parts are a little hollower than the mask, by their convex hulls."""
    center = np.array([part.box_center for part in truth.parts])
    size = np.array([part.box_size for part in truth.parts])
    body = bodies[0].stretched(center, size)
    state = np.array([joint.state for joint in truth.joints])
    at = posed(body, pose_of(body, truth.parts[0].cam_T_part, state))
    seen = silhouette(body, at, CAMERA.K, (CAMERA.height, CAMERA.width))
    mask = np.repeat(np.uint8(255 * seen)[..., None], 3, axis=-1)
    target = given_target(read_image(mask), truth, 1.25)
    found = fitted(truth, bodies, target, 12)
    assert distance(found, truth) < 0.02 * (BOX[2] - BOX[0])


def test_the_networks_own_mask_is_brought_to_the_crops_rays(predictor, pixels):
    """Where it sees the object in the crop, there the photo's rays go."""
    view = crop_square(pixels, CAMERA, (-60, -20, 120, 160), 160, 1.25)
    share = np.zeros((20, 20), np.float32)
    share[8:12, 8:12] = 1
    target = own_target(share, view, read_image(pixels))
    y, x = np.nonzero(target.mask > 0.5)
    assert (x.mean() + 0.5, y.mean() + 0.5) == pytest.approx((40, 40), abs=0.5)
    ray = np.linalg.inv(target.K) @ [40, 40, 1]
    np.testing.assert_allclose(ray, np.linalg.inv(view.camera.K) @ [80, 80, 1], atol=1e-9)
    left, top, _, _ = view.from_photo((0, 0, 1, 1))
    unknown = np.argwhere(target.known == 0)
    assert len(unknown) > 100
    assert ((unknown[:, 1] < left / 2) | (unknown[:, 0] < top / 2)).all()


def test_the_predictor_refines_by_itself_unless_told_not_to(predictor, pixels):
    plain = predictor.predict(pixels, CAMERA, "laptop", BOX, refine=0)
    assert plain.refinement is None
    refined = predictor.predict(pixels, CAMERA, "laptop", BOX)
    assert refined.refinement or any("not refined" in w for w in refined.warnings)


def test_a_mask_also_gives_the_box(predictor, pixels):
    mask = np.zeros_like(pixels)
    mask[50:200, 70:230] = 255
    found = predictor.predict(pixels, CAMERA, "drawer", mask=mask)
    assert found.box == (70, 50, 230, 200)
    assert found.refinement is not None
    corners = np.concatenate([p.corners().reshape(-1, 3) for p in found.parts])
    uv = CAMERA.project(corners)
    np.testing.assert_allclose([*uv.min(0), *uv.max(0)], found.box, atol=25)


def test_masks_and_steps_that_cannot_be_meant_are_refused(predictor, pixels):
    def attempt(**options):
        predictor.predict(pixels, CAMERA, "laptop", BOX, **options)

    with pytest.raises(UsageError, match="0 steps"):
        attempt(refine=-1)
    with pytest.raises(InputError, match="of the photo's size"):
        attempt(mask=pixels[:100])
    with pytest.raises(InputError, match="black all over"):
        attempt(mask=np.zeros_like(pixels))
    elsewhere = np.zeros_like(pixels)
    elsewhere[:5, :5] = 255
    found = predictor.predict(pixels, CAMERA, "laptop", (200, 150, 300, 230), mask=elsewhere)
    assert any("not refined" in w for w in found.warnings)
