"""The paper's network: three branches, each with a backbone that is one word."""

from dataclasses import fields

import pytest
import torch

from r2art.method.backbones import FeatureMap
from r2art.method.estimate import estimate
from r2art.method.outputs import NodePoses, RawEstimate, TrainingOutput
from r2art.method.paper_network import PaperNet

SIZE, CROPS, PHOTOS = 224, 2, 1
SMALL = {"features": "mobilenetv2_050", "depth": "mobilenetv2_050", "joint": "mobilenetv2_050"}


@pytest.fixture
def inputs():
    K = torch.tensor([[280.0, 0, 105], [0, 300, 115], [0, 0, 1]]).expand(CROPS, 3, 3)
    box = torch.tensor([[28.0, 42, 182, 196]]) + 4 * torch.randn(CROPS, 4)
    images = 2 * torch.rand(CROPS + PHOTOS, 3, SIZE, SIZE) - 1
    return images[:CROPS], box, K, images[CROPS:]


def small(*categories, **options) -> PaperNet:
    return PaperNet(categories, **SMALL | options, width=32)


def numbers(raw: RawEstimate) -> dict[str, torch.Tensor]:
    found = {f.name: getattr(raw, f.name) for f in fields(RawEstimate) if f.name != "nodes"}
    if raw.nodes is not None:
        found |= {f"nodes.{f.name}": getattr(raw.nodes, f.name) for f in fields(NodePoses)}
    return found


def taught(network: PaperNet, output: TrainingOutput) -> set[str]:
    """The parts of the network that all it says depends on."""
    said = [output.found_box, output.category_logits]
    for of_crops in output.crops.values():
        said += numbers(of_crops.raw).values()
    sum(v.square().sum() for v in said).backward()
    return {name.split(".")[0] for name, p in network.named_parameters() if p.grad is not None}


@pytest.mark.parametrize(
    ("features", "depth", "joint"),
    [
        ("vit_small_patch14_dinov2", "hrnet_w18_small", "resnet18"),
        pytest.param(
            "vit_base_patch14_dinov2", "mobilenetv2_050", "resnet10t", marks=pytest.mark.slow
        ),
        ("resnet10t", "resnet10t", "hrnet_w18_small"),
        ("hrnet_w18_small", "mobilenetv2_050", "vit_tiny_patch16_224"),
    ],
)
def test_every_backbone_is_one_word(chest, inputs, features, depth, joint):
    network = PaperNet((chest,), features, depth, joint, SIZE, width=32)
    crop, box, K, photo = inputs
    output = network(("chest",), crop, box, K, photo)
    found = estimate(network.priors["chest"], output.crops["chest"].raw, box, K)
    assert found.cam_T_part.shape == (CROPS, 4, 4, 4)
    assert found.joint_state.shape == (CROPS, 3)
    assert output.found_box.shape == (PHOTOS, 4)
    assert output.category_logits.shape == (PHOTOS, 2)
    of_crops = output.crops["chest"]
    assert of_crops.dense is of_crops.object_logits is output.object_logits is None
    everything = {name.split(".")[0] for name, _ in network.named_parameters()}
    assert taught(network, output) == everything - {"frozen"}


def test_frozen_features_can_be_computed_before(chest, inputs):
    crop, box, K, photo = inputs
    network = small(chest).eval()
    known = network.offline(torch.cat([crop, photo]))

    def said(**features) -> RawEstimate:
        return network(("chest",), crop, box, K, photo, **features).crops["chest"].raw

    first, second = said(), said(offline=known)
    for key, value in numbers(first).items():
        torch.testing.assert_close(numbers(second)[key], value, msg=key)
    other = said(offline=known.roll(1, dims=0))
    assert not torch.allclose(other.up, first.up)


def test_what_is_frozen_stays_so_in_training(chest, inputs):
    crop, box, K, photo = inputs
    network = small(chest).train()
    before = {k: v.clone() for k, v in network.state_dict().items()}
    network(("chest",), crop, box, K, photo)
    changed = {k for k, v in network.state_dict().items() if not torch.equal(v, before[k])}
    assert {k.split(".")[0] for k in changed} >= {"depth", "joint", "unet"}  # their statistics
    assert not any(k.startswith("frozen.") for k in changed)
    assert not any(p.requires_grad for p in network.frozen.parameters())


def test_asked_by_halves_it_says_the_same(chest, cubes, inputs):
    """What export and inference call is what training calls."""
    crop, box, K, photo = inputs
    network = small(chest, cubes).eval()
    whole = network(("chest",), crop, box, K, photo)
    _, seen = network.features(crop)
    raw = network.estimate_raw("chest", seen, box, K)
    for key, value in numbers(whole.crops["chest"].raw).items():
        torch.testing.assert_close(numbers(raw)[key], value, msg=key)
    found_box, logits = network.find(network.features(photo)[1])
    torch.testing.assert_close(found_box, whole.found_box)
    torch.testing.assert_close(logits, whole.category_logits)


def test_categories_asked_together_say_what_each_says_alone(chest, cubes, inputs):
    """Equally many crops of each, in the order of the names."""
    crop, box, K, photo = inputs
    network = small(chest, cubes).eval()
    twice = (torch.cat([crop, crop.flip(0)]), torch.cat([box, box.flip(0)]), torch.cat([K, K]))
    together = network(("cubes", "chest"), *twice, photo)
    assert list(together.crops) == ["cubes", "chest"]
    alone = {
        "cubes": network(("cubes",), crop, box, K, photo),
        "chest": network(("chest",), crop.flip(0), box.flip(0), K, photo),
    }
    for name, output in alone.items():
        for key, value in numbers(output.crops[name].raw).items():
            found = numbers(together.crops[name].raw)[key]
            torch.testing.assert_close(found, value, rtol=0, atol=1e-4, msg=key)
        torch.testing.assert_close(together.found_box, output.found_box, rtol=0, atol=1e-2)


@pytest.mark.parametrize(
    ("branch", "moves"),
    [
        ("frozen", {"up", "right", "phi", "log_lambda", "log_scale", "center_shift"}),
        ("depth", {"log_lambda", "log_scale", "center_shift"}),
        ("joint", {"joint_share"}),
    ],
)
def test_the_branches_are_decoupled(chest, inputs, branch, moves):
    """As in the paper: no branch's backbone moves what another estimates."""
    crop, box, K, photo = inputs
    network = small(chest).eval()
    before = numbers(network(("chest",), crop, box, K, photo).crops["chest"].raw)
    for parameter in getattr(network, branch).parameters():
        parameter.data.mul_(1.5)
    after = numbers(network(("chest",), crop, box, K, photo).crops["chest"].raw)
    changed = {k for k in before if not torch.allclose(before[k], after[k], rtol=0, atol=1e-7)}
    assert changed - {"confidence_logit"} == moves


def test_the_depth_branch_knows_the_camera_and_no_other_does(chest, inputs):
    crop, box, K, photo = inputs
    network = small(chest).eval()
    before = numbers(network(("chest",), crop, box, K, photo).crops["chest"].raw)
    zoomed = K * torch.tensor([2.0, 2.0, 1.0])[:, None]
    after = numbers(network(("chest",), crop, box, zoomed, photo).crops["chest"].raw)
    changed = {k for k in before if not torch.allclose(before[k], after[k], rtol=0, atol=1e-7)}
    assert changed - {"confidence_logit"} == {"log_lambda", "log_scale", "center_shift"}


def test_part_centric_heads_pose_every_part(chest, inputs):
    crop, box, K, photo = inputs
    network = small(chest, pose_heads="part")
    output = network(("chest",), crop, box, K, photo)
    nodes = output.crops["chest"].raw.nodes
    assert nodes is not None
    assert nodes.up.shape == nodes.right.shape == (CROPS, 3, 3)
    assert nodes.phi.shape == (CROPS, 3, 2)
    assert nodes.log_lambda.shape == (CROPS, 3)
    assert "joint" not in taught(network, output)


@pytest.mark.parametrize(
    ("backbone", "size", "shape"),
    [
        ("vit_tiny_patch16_224", 64, (192, 4, 4)),
        ("swin_tiny_patch4_window7_224", 224, (768, 7, 7)),
        ("resnet10t", 64, (512, 2, 2)),
    ],
)
def test_features_lie_where_in_the_picture_they_were_seen(backbone, size, shape):
    """A picture that changes in its top right corner changes the features there most."""
    extractor = FeatureMap(backbone, size).eval()
    image = torch.zeros(1, 3, size, size)
    corner = image.clone()
    corner[..., : size // 4, -size // 4 :] = 1.0
    with torch.no_grad():
        change = (extractor(corner) - extractor(image))[0]
    assert change.shape == shape
    assert (extractor.channels, extractor.side) == shape[:2]
    row, column = divmod(int(change.norm(dim=0).argmax()), shape[-1])
    assert row < shape[-1] / 2 <= column


def test_a_size_that_suits_no_patches_is_refused(chest):
    with pytest.raises(ValueError, match="multiple of 32, got 100"):
        small(chest, input_size=100)
    with pytest.raises(ValueError, match="input size 64 is no multiple of the 14 px patches"):
        small(chest, features="vit_small_patch14_dinov2", input_size=64)
