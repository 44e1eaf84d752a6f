"""Whatever is done to the picture is done to its labels."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from r2art.core.camera import Camera
from r2art.core.image import crop_square, letterbox
from r2art.data.sample import BACKDROP
from r2art.learn import augment, relabel
from r2art.learn.chance import Chance
from r2art.method import se3
from r2art.method.projection import box_center, project
from r2art.method.shape import box_corners

S = 96
CPU = torch.device("cpu")


def chance(seed: int = 0) -> Chance:
    return Chance(seed, CPU)


@pytest.fixture(params=["laptop", "drawer"])
def some(request, photos):
    return photos[request.param]


@pytest.fixture
def ramps(some):
    """The same labels with pictures that tell each pixel's x and y, and that it is theirs."""
    n, _, height, width = some.image.shape
    x, y = torch.arange(width) * 4, torch.arange(height) * 4
    full = torch.full((height, width), 255)
    image = torch.stack([x.expand_as(full), y[:, None].expand_as(full), full]).to(torch.uint8)
    return replace(some, image=image.expand(n, 3, height, width))


def decoded(image: torch.Tensor) -> torch.Tensor:
    """(B, 2, S, S) where in the photo (px) each pixel of a view of `ramps` was taken from."""
    return ((image[:, :2] + 1) * 127.5) / 4 + 0.5


def centers(size: int = S) -> torch.Tensor:
    """(2, S, S) x and y of the pixels' centres."""
    at = torch.arange(size) + 0.5
    return torch.stack([at.expand(size, size), at[:, None].expand(size, size)])


def of_the_photo(image: torch.Tensor) -> torch.Tensor:
    """(B, S, S) pixels of a view of `ramps` that nothing from outside was mixed into."""
    return image[:, 2] > 0.999


def every(photos) -> torch.Tensor:
    return torch.arange(len(photos))


def corners(labels) -> torch.Tensor:
    """(B, P·8, 3) corners of all part boxes in the camera frame."""
    points = box_corners(labels.box_center, labels.box_size)
    return se3.transform(labels.cam_T_part, points).flatten(1, 2)


@pytest.mark.parametrize("jittered", [False, True])
def test_a_crops_pixel_keeps_its_viewing_ray(ramps, jittered):
    if jittered:
        ramps = replace(ramps, box=augment.jitter(ramps.box, chance(1)))
    crops = augment.crops(ramps, every(ramps), S, chance(), None, augment=False)
    before = decoded(crops.image)
    ray = (before - ramps.K[:, :2, 2, None, None]) / ramps.K[:, [0, 1], [0, 1], None, None]
    ray_after = (centers() - crops.K[:, :2, 2, None, None]) / crops.K[:, [0, 1], [0, 1], None, None]
    pixel = 1 / ramps.K[:, 0, 0, None, None]
    error = (ray - ray_after).abs().amax(dim=1) / pixel
    seen = of_the_photo(crops.image)
    assert seen.float().mean() > 0.5
    assert error[seen].max() < 0.2  # px of the photo, whose bytes tell eighths


def test_box_corners_project_where_the_crop_has_moved_them(some):
    """The box is a label of its own: it gives the window without looking at K."""
    crops = augment.crops(some, every(some), S, chance(), None, augment=False)
    zoom = (crops.box[:, 2:] - crops.box[:, :2]) / (some.box[:, 2:] - some.box[:, :2])
    before = project(corners(some), some.K)
    moved = crops.box[:, None, :2] + (before - some.box[:, None, :2]) * zoom[:, None]
    torch.testing.assert_close(project(corners(crops), crops.K), moved, rtol=0, atol=2e-2)


def test_the_window_is_centred_on_the_box_with_the_margin(some):
    crops = augment.crops(some, every(some), S, chance(), None, augment=False)
    middle = torch.full((len(some), 2), S / 2)
    torch.testing.assert_close(box_center(crops.box), middle, rtol=0, atol=1e-3)
    longer = (crops.box[:, 2:] - crops.box[:, :2]).amax(dim=1)
    torch.testing.assert_close(longer, torch.full_like(longer, S / augment.CROP_MARGIN))


def test_masks_go_with_the_picture(ramps):
    crops = augment.crops(ramps, every(ramps), S, chance(), None, augment=False)
    cell = S // crops.part.shape[-1]
    assert cell == augment.MASK_STRIDE
    at = torch.nn.functional.avg_pool2d(decoded(crops.image), cell)  # of a ramp: the cell's centre
    whole = torch.nn.functional.avg_pool2d(of_the_photo(crops.image).float(), cell) == 1
    clear = whole & ((at - at.round()).abs().amin(dim=1) > 0.1)  # not between two pixels
    column, row = at.floor().long().clamp(0, ramps.image.shape[-1] - 1).unbind(dim=1)
    image = torch.arange(len(ramps))[:, None, None].expand_as(row)
    assert clear.float().mean() > 0.2
    assert torch.equal(crops.part[clear], ramps.mask[image, row, column].long()[clear])


def assert_looks_alike(view: np.ndarray, image: torch.Tensor) -> None:
    """Up to rounding, and what either does in the pixels that the photo's edge cuts."""
    pixels = ((image + 1) * 127.5).permute(1, 2, 0).numpy()
    difference = np.abs(view - pixels).max(axis=-1)
    assert np.quantile(difference, 0.9) < 2
    assert np.count_nonzero(difference > 4) < 4 * S


def test_training_sees_what_prediction_sees(some):
    index = every(some)
    crops = augment.crops(some, index, S, chance(), None, augment=False)
    views = augment.views(some.pick(index, CPU), S, chance(), None, augment=False)
    size = some.image.shape[-1]
    for i in index:
        (fx, _, cx), (_, fy, cy), _ = some.K[i].tolist()
        camera = Camera(fx, fy, cx, cy, size, size)
        pixels, box = some.image[i].permute(1, 2, 0).numpy(), some.box[i].tolist()
        crop = crop_square(pixels, camera, box, S, augment.CROP_MARGIN)
        whole = letterbox(pixels, camera, S)
        np.testing.assert_allclose(crop.camera.K, crops.K[i], rtol=1e-4, atol=1e-3)
        np.testing.assert_allclose(crop.from_photo(box), crops.box[i], rtol=1e-4, atol=1e-3)
        np.testing.assert_allclose(whole.from_photo(box), views.box[i], rtol=1e-4, atol=1e-3)
        assert_looks_alike(crop.pixels, crops.image[i])
        assert_looks_alike(whole.pixels, views.image[i])


def test_what_lies_outside_of_the_photo_is_grey(ramps):
    box = torch.tensor([[-30.0, -30.0, 20.0, 20.0]]).repeat(len(ramps), 1)
    ramps = replace(ramps, box=box)
    crops = augment.crops(ramps, every(ramps), S, chance(), None, augment=False)
    side = 50 * augment.CROP_MARGIN
    x, y = -5 - side / 2 + centers() * side / S
    outside = (x < -0.6) | (y < -0.6)
    assert outside.sum() > S
    assert crops.image[:, :, outside].abs().max() == 0
    assert crops.part[:, :2, :2].max() == 0


@pytest.mark.parametrize("augmented", [False, True])
def test_a_letterboxed_photo_keeps_its_shape_and_the_bars_are_grey(ramps, augmented):
    boxes = ramps.box.clone()
    n = len(ramps)
    picked = ramps.pick(every(ramps), CPU)
    views = augment.views(picked, S, chance(2), None, augment=augmented)
    zoom = (views.box[:, 2:] - views.box[:, :2]) / (boxes[:, 2:] - boxes[:, :2])
    torch.testing.assert_close(zoom[:, 0], zoom[:, 1], rtol=1e-4, atol=1e-4)
    if augmented:
        grey = (views.image == 0).all(dim=1).flatten(1).float().mean(dim=1)
        assert grey.max() > 0.05  # another format leaves bars
    else:
        expected = (
            boxes[:, None, :2]
            + (centers().flatten(1).T - views.box[:, None, :2]) / zoom.mean(dim=1)[:, None, None]
        )
        error = (decoded(views.image).flatten(2).mT - expected).abs().amax(dim=2)
        seen = of_the_photo(views.image).flatten(1)
        assert seen.float().mean() > 0.8
        assert error[seen].max() < 0.2
    assert views.seen.shape == (n, 1, S // augment.MASK_STRIDE, S // augment.MASK_STRIDE)


def test_the_letterboxed_object_is_seen_inside_of_its_box(some):
    views = augment.views(some.pick(every(some), CPU), S, chance(3), None)
    at = centers(S // augment.MASK_STRIDE) * augment.MASK_STRIDE
    for seen, (x1, y1, x2, y2) in zip(views.seen[:, 0], views.box, strict=True):
        within = (at[0] > x1 - 8) & (at[0] < x2 + 8) & (at[1] > y1 - 8) & (at[1] < y2 + 8)
        assert seen.max() > 0.3
        assert torch.all(seen[~within] == 0)


def test_another_format_still_shows_all_of_the_object_that_the_photo_does(some):
    size = some.image.shape[-1]
    whole = torch.tensor([0.0, 0, size, size]).expand(len(some), 4)
    for seed in range(10):
        seen = augment.format_around(some.box, whole, chance(seed))
        needed = torch.cat([some.box[:, :2].clamp_min(0), some.box[:, 2:].clamp_max(size)], dim=1)
        assert torch.all(seen[:, :2] <= needed[:, :2] + 1e-3)
        assert torch.all(seen[:, 2:] >= needed[:, 2:] - 1e-3)
        assert torch.all((seen >= -1e-3) & (seen <= size + 1e-3))
        assert torch.any(seen != whole)


@pytest.mark.parametrize("seed", range(3))
def test_augmented_labels_still_describe_the_picture(some, seed):
    """Even relabelled for another camera: parts are seen inside of their projected boxes."""
    crops = augment.crops(some, every(some), S, chance(seed), None)
    at = (centers(S // augment.MASK_STRIDE) * augment.MASK_STRIDE).flatten(1).T
    num_parts = crops.box_size.shape[1]
    uv = project(corners(crops), crops.K).unflatten(1, (num_parts, 8))
    lower, upper = uv.amin(dim=2) - 4, uv.amax(dim=2) + 4
    for part in range(num_parts):
        inside = (at > lower[:, part, None]).all(-1) & (at < upper[:, part, None]).all(-1)
        seen = crops.part.flatten(1) == part + 1
        assert torch.count_nonzero(seen & ~inside) <= 0.02 * torch.count_nonzero(seen)
        assert seen.any()


def test_only_the_backdrop_is_swapped(some):
    image, mask = augment.pictures(some.pick(every(some), CPU), chance(), None, augment=True)
    original = some.image.float() / 127.5 - 1
    changed = (image != original).any(dim=1)
    assert changed.any()
    assert torch.all(mask[changed] == BACKDROP)
    assert torch.equal(mask, some.mask.float())


def test_photos_that_are_not_square_get_other_backdrops_too(some):
    wide = replace(some, image=some.image[:, :, 20:], mask=some.mask[:, 20:])
    picked = wide.pick(every(some), CPU)
    image, mask = augment.pictures(picked, chance(), None, augment=True)
    plain, _ = augment.pictures(picked, chance(), None, augment=False)
    assert image.shape[-2:] == mask.shape[-2:] == wide.image.shape[-2:]
    assert (image == plain).all(dim=1)[mask != BACKDROP].all()


def test_backdrops_are_taken_from_the_given_photos():
    given = torch.full((2, 3, 32, 32), 255, dtype=torch.uint8)
    given[:, 1:] = 0
    made = augment.other_backdrops(64, 24, chance(), given)
    red = torch.tensor([1.0, -1.0, -1.0])[:, None, None].expand(3, 24, 24)
    is_red = torch.tensor([torch.allclose(picture, red, atol=1e-5) for picture in made])
    assert 0.4 < is_red.float().mean() < 0.9  # the others are plain


def test_a_place_that_the_object_half_fills_is_half_seen(some):
    """Pixel for pixel, with the object's edge a pixel further left in every crop."""
    n, (height, width) = 4, some.mask.shape[1:]
    mask = torch.full_like(some.mask, BACKDROP)
    mask[:, :, :30] = 2
    mask[:, 32:, :30] = 1  # whichever part it is
    side, center = 32, 30 + torch.arange(n)[:, None]
    half = torch.tensor([-1, -1, 1, 1]) * side / augment.CROP_MARGIN / 2
    box = some.box.clone()
    box[:n] = torch.cat([center, torch.full((n, 1), 32)], dim=1).repeat(1, 2) + half
    edged = replace(some, mask=mask, box=box)
    crops = augment.crops(edged, torch.arange(n), side, chance(), None, augment=False)
    expected = torch.tensor([[1.0, 1.0, 1.0, 1 - i / 4, 0.0, 0.0, 0.0, 0.0] for i in range(n)])
    expected = expected[:, None, None].expand(n, 1, 8, 8)
    torch.testing.assert_close(crops.seen, expected, rtol=0, atol=1e-4)
    picked = edged.pick(torch.arange(n), CPU)
    views = augment.views(picked, width, chance(), None, augment=False)
    columns = torch.tensor([1.0] * 7 + [0.5] + [0.0] * (width // 4 - 8))
    torch.testing.assert_close(
        views.seen, columns.expand(n, 1, height // 4, width // 4), rtol=0, atol=1e-4
    )


def test_crops_of_two_categories_are_those_of_each(photos):
    chosen = [(p, torch.arange(n)) for p, n in zip(photos.values(), (5, 3), strict=True)]
    together = augment.crops_of(chosen, S, chance(), None, augment=False)
    assert [len(c.image) for c in together] == [5, 3]
    for found, (some, index) in zip(together, chosen, strict=True):
        alone = augment.crops(some, index, S, chance(), None, augment=False)
        for name, value in vars(alone).items():
            torch.testing.assert_close(getattr(found, name), value, msg=name)


def test_what_covers_the_picture_covers_the_masks():
    n, cells = 256, S // augment.MASK_STRIDE
    image, part = torch.zeros(n, 3, S, S), torch.full((n, 1, cells, cells), 2.0)
    seen = torch.rand(n, 1, cells, cells)
    covered, left, still = augment.occlude(image, part, seen, chance(), None)
    changed = (covered != 0).any(dim=1, keepdim=True).float()
    hidden = changed.flatten(1).any(dim=1)
    assert 0.3 < hidden.float().mean() < 0.5
    free = 1 - torch.nn.functional.avg_pool2d(changed, augment.MASK_STRIDE)
    assert ((free > 0) & (free < 1)).any()  # at the edge of what covers it
    torch.testing.assert_close(still, free * seen)
    assert torch.equal(left, torch.where(free < 0.5, 0.0, part))
    assert torch.equal(still[~hidden], seen[~hidden])


def test_views_are_pictures_again_for_every_seed_and_the_same_for_the_same(some):
    index = chance().choice(len(some), 12)
    backdrops = some.image
    made = [augment.crops(some, index, S, chance(s), backdrops) for s in (1, 1, 2)]
    picked = some.pick(index, CPU)
    views = [augment.views(picked, S, chance(s), backdrops) for s in (1, 1, 2)]
    for first, again, other in (made, views):
        for name, value in vars(first).items():
            assert torch.equal(value, getattr(again, name))
        assert not torch.equal(first.image, other.image)
        assert not torch.equal(first.box, other.box)
        assert -1 <= first.image.min() < -0.5
        assert 0.5 < first.image.max() <= 1


def test_jitter_moves_every_side_by_at_most_a_fifth():
    box = torch.tensor([[10.0, 20.0, 60.0, 120.0]]).repeat(2000, 1)
    off = (augment.jitter(box, chance()) - box) / torch.tensor([50.0, 100.0, 50.0, 100.0])
    assert off.abs().max() <= 0.2 + 1e-6
    assert 0.03 < off.std() < 0.08
    assert off.mean(dim=0).abs().max() < 0.01


def poses_seen_through(some, factor: float):
    stated = some.K.clone()
    stated[:, :2, :2] *= factor
    points = box_corners(some.box_center, some.box_size)
    args = ([stated], [some.cam_T_part], [points], [some.box], [some.K])
    return stated, relabel.poses_through(*args)[0]


def test_through_the_true_camera_a_pose_stays(some):
    _, poses = poses_seen_through(some, 1.0)
    torch.testing.assert_close(poses, some.cam_T_part, rtol=0, atol=1e-3)


@pytest.mark.parametrize("factor", [0.7, 1.4])
def test_through_another_camera_the_object_still_looks_alike(some, factor):
    stated, poses = poses_seen_through(some, factor)
    truth = project(corners(some), some.K)
    extent = (some.box[:, 2:] - some.box[:, :2]).amax(dim=1)

    def error(cam_T_part):
        uv = project(corners(replace(some, cam_T_part=cam_T_part)), stated)
        return torch.linalg.vector_norm(uv - truth, dim=-1).mean(dim=1) / extent

    assert torch.all(error(poses) < 0.06)
    assert torch.all(error(poses) < 0.5 * error(some.cam_T_part))
    # It moved as one: no joint opened further, nothing was scaled.
    before, after = (se3.inverse(T[:, :1]) @ T for T in (some.cam_T_part, poses))
    torch.testing.assert_close(after, before, rtol=0, atol=1e-4)
    R = poses[:, 0, :3, :3]
    torch.testing.assert_close(R @ R.mT, torch.eye(3).expand_as(R), rtol=0, atol=1e-4)
    assert torch.all((poses[:, 0, 2, 3] > some.cam_T_part[:, 0, 2, 3]) == (factor > 1))


def test_poses_of_two_categories_at_once_are_those_of_each(photos):
    """Whatever the numbers of their parts and of their photos."""
    some = list(photos.values())
    stated = [p.K.clone() for p in some]
    for K in stated:
        K[:, :2, :2] *= 1.3
    points = [box_corners(p.box_center, p.box_size) for p in some]
    assert len({p.shape[1] for p in points}) == len({len(p) for p in some}) == 2
    together = relabel.poses_through(
        stated, [p.cam_T_part for p in some], points, [p.box for p in some], [p.K for p in some]
    )
    for p, found in zip(some, together, strict=True):
        assert not torch.allclose(found, p.cam_T_part, atol=0.01)
        torch.testing.assert_close(found, poses_seen_through(p, 1.3)[1], rtol=0, atol=1e-3)
