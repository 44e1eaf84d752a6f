"""The network: shapes for every category, any backbone by its name, sensible first answers."""

from dataclasses import fields

import pytest
import torch

from r2art.method.depth import projection_depth
from r2art.method.estimate import estimate
from r2art.method.layers import geometric_cues
from r2art.method.network import R2ArtNet
from r2art.method.outputs import RawEstimate

SIZE, CROPS, PHOTOS = 64, 3, 2
SMALL = "mobilenetv2_050"


def numbers(raw: RawEstimate) -> dict[str, torch.Tensor]:
    """The fields that a joint-centric network fills."""
    assert raw.nodes is None
    return {f.name: getattr(raw, f.name) for f in fields(RawEstimate) if f.name != "nodes"}


def make(categories, backbone: str = SMALL, **options) -> R2ArtNet:
    return R2ArtNet(categories, backbone, SIZE, width=32, **options)


@pytest.fixture
def inputs():
    K = torch.tensor([[80.0, 0, 30], [0, 85, 33], [0, 0, 1]]).expand(CROPS, 3, 3)
    box = torch.tensor([[8.0, 12, 52, 56]]) + torch.randn(CROPS, 4)
    return torch.rand(CROPS, 3, SIZE, SIZE), box, K, torch.rand(PHOTOS, 3, SIZE, SIZE)


@pytest.mark.parametrize(
    "backbone", [SMALL, "resnet10t", "mobilenetv4_conv_small", "convnext_atto"]
)
def test_another_backbone_is_another_word(cubes, chest, inputs, backbone):
    network = make((cubes, chest), backbone)
    image, box, K, photo = inputs
    for category in (cubes, chest):
        num_parts, num_joints = len(category.part_names), len(category.joints)
        output = network(category.name, image, box, K, photo)
        shapes = {k: tuple(v.shape) for k, v in numbers(output.raw).items()}
        assert shapes == {
            "up": (CROPS, 3),
            "right": (CROPS, 3),
            "phi": (CROPS, 2),
            "log_lambda": (CROPS,),
            "joint_share": (CROPS, num_joints),
            "log_scale": (CROPS, num_parts, 3),
            "center_shift": (CROPS, num_parts, 3),
            "confidence_logit": (CROPS, num_parts),
        }
        assert output.mask_logits.shape == (CROPS, num_parts + 1, SIZE // 4, SIZE // 4)
        assert output.found_box.shape == (PHOTOS, 4)
        assert output.category_logits.shape == (PHOTOS, 3)
        assert output.photo_mask_logits.shape == (PHOTOS, 1, SIZE // 4, SIZE // 4)
        found = estimate(network.priors[category.name], output.raw, box, K)
        assert found.cam_T_part.shape == (CROPS, num_parts, 4, 4)
        assert found.axis.shape == found.pivot.shape == (CROPS, num_joints, 3)


def test_what_has_no_such_features_is_refused(cubes):
    with pytest.raises(ValueError, match="multiple of 32, got 100"):
        R2ArtNet((cubes,), SMALL, input_size=100)
    with pytest.raises(ValueError, match=r"strides \[[\d, ]+\], but 4, 8, 16 and 32"):
        R2ArtNet((cubes,), "vit_tiny_patch16_224", SIZE, backbone_options={"img_size": SIZE})


def test_before_training_an_object_stands_before_the_camera_half_open(chest, inputs):
    network = make((chest,)).eval()
    image, box, K, photo = inputs
    raw = network("chest", image, box, K, photo).raw
    found = estimate(network.priors["chest"], raw, box, K)
    torch.testing.assert_close(raw.joint_share, torch.full((CROPS, 3), 0.5), rtol=0, atol=0.2)
    torch.testing.assert_close(
        found.shape.box_size, network.priors["chest"].box_size.expand(CROPS, 4, 3), rtol=0.2, atol=0
    )
    R = found.cam_T_part[:, 0, :3, :3]
    assert torch.all(R[:, 2, 2] < -0.7)  # its front faces us,
    assert torch.all(R[:, 1, 1] < -0.7)  # upright,
    assert torch.all(R[:, 2, 1] < 0)  # and we look down on it
    depth = projection_depth(box, K, chest.frontal_area)
    torch.testing.assert_close(found.cam_T_part[:, 0, 2, 3], depth, rtol=0.2, atol=0)


def test_the_root_part_is_never_shifted(chest, inputs):
    image, box, K, photo = inputs
    raw = make((chest,))("chest", image, box, K, photo).raw
    assert torch.all(raw.center_shift[:, 0] == 0)
    assert torch.all(raw.center_shift[:, 1:] != 0)


def test_the_confidence_does_not_teach_the_features(chest, inputs):
    image, box, K, photo = inputs
    network = make((chest,))
    network("chest", image, box, K, photo).raw.confidence_logit.sum().backward()
    taught = {name.split(".")[0] for name, p in network.named_parameters() if p.grad is not None}
    assert taught == {"heads"}


def test_a_category_is_read_by_its_own_heads(cubes, chest, inputs):
    """Training one category's heads leaves what is said of the other."""
    image, box, K, photo = inputs
    network = make((cubes, chest)).eval()
    before = network("cubes", image, box, K, photo).raw
    with torch.no_grad():
        for parameter in network.heads["chest"].parameters():
            parameter.add_(1.0)
    after = network("cubes", image, box, K, photo).raw
    for name, value in numbers(before).items():
        assert torch.equal(value, numbers(after)[name]), name


def test_crops_do_not_see_each_other(cubes, inputs):
    image, box, K, photo = inputs
    network = make((cubes,)).eval()
    together = network("cubes", image, box, K, photo)
    for i in range(CROPS):
        alone = network("cubes", image[i : i + 1], box[i : i + 1], K[i : i + 1], photo[:1])
        for key, value in numbers(alone.raw).items():
            torch.testing.assert_close(value[0], numbers(together.raw)[key][i], rtol=0, atol=1e-4)
    torch.testing.assert_close(alone.found_box[0], together.found_box[0], rtol=0, atol=1e-3)


def test_numbers_that_become_poses_are_float32_in_mixed_precision(cubes, inputs):
    image, box, K, photo = inputs
    with torch.autocast("cpu", torch.bfloat16):
        output = make((cubes,))("cubes", image, box, K, photo)
    assert output.mask_logits.dtype == torch.bfloat16  # the rest is cheap
    for key, value in numbers(output.raw).items():
        assert value.dtype == torch.float32, key
    assert output.found_box.dtype == torch.float32


def test_cues_do_not_change_when_image_and_camera_are_resized_together(inputs):
    _, box, K, _ = inputs
    twice = K * torch.tensor([2.0, 2.0, 1.0])[:, None]
    torch.testing.assert_close(geometric_cues(2 * box, twice, 0.1), geometric_cues(box, K, 0.1))
