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
        output = network((category.name,), image, box, K, photo)
        assert list(output.crops) == [category.name]
        of_crops = output.crops[category.name]
        shapes = {k: tuple(v.shape) for k, v in numbers(of_crops.raw).items()}
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
        places = (SIZE // 4, SIZE // 4)
        assert of_crops.dense.part_logits.shape == (CROPS, num_parts + 1, *places)
        assert of_crops.dense.coordinates.shape == (CROPS, 3, *places)
        assert of_crops.dense.log_deviation.shape == (CROPS, *places)
        assert of_crops.object_logits.shape == (CROPS, 1, SIZE // 4, SIZE // 4)
        assert output.found_box.shape == (PHOTOS, 4)
        assert output.category_logits.shape == (PHOTOS, 3)
        assert output.object_logits.shape == (PHOTOS, 1, SIZE // 4, SIZE // 4)
        found = estimate(network.priors[category.name], of_crops.raw, box, K)
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
    raw = network(("chest",), image, box, K, photo).crops["chest"].raw
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
    raw = make((chest,))(("chest",), image, box, K, photo).crops["chest"].raw
    assert torch.all(raw.center_shift[:, 0] == 0)
    assert torch.all(raw.center_shift[:, 1:] != 0)


def test_a_frozen_trunk_says_the_same_before_and_during_training(chest, inputs):
    crop, box, K, photo = inputs
    network = make((chest,), frozen_to=32).train()
    before = {k: v.clone() for k, v in network.state_dict().items()}
    image = torch.cat([crop, photo])
    known = network.offline(image)
    for kept, of_trunk in zip(network.maps(known), network.trunk(image), strict=True):
        torch.testing.assert_close(kept, of_trunk)

    def said(**features) -> dict[str, torch.Tensor]:
        output = network(("chest",), crop, box, K, photo, **features)
        return numbers(output.crops["chest"].raw) | {"found_box": output.found_box}

    first, second = said(), said(offline=known)
    for key, value in first.items():
        torch.testing.assert_close(second[key], value, rtol=1e-4, atol=1e-5, msg=key)
    other = said(offline=known.roll(1, dims=0))
    assert not torch.allclose(other["up"], first["up"], rtol=1e-3)
    sum(v.sum() for v in second.values()).backward()
    taught = {k.split(".")[0] for k, p in network.named_parameters() if p.grad is not None}
    assert {"neck", "heads", "found_box"} <= taught
    changed = {k.split(".")[0] for k, v in network.state_dict().items() if (v != before[k]).any()}
    assert "neck" in changed  # its statistics
    assert "trunk" not in taught | changed


@pytest.mark.parametrize("backbone", [SMALL, "resnet10t"])
def test_layers_up_to_a_stride_can_stay_as_they_are(chest, inputs, backbone):
    network = make((chest,), backbone, frozen_to=8).train()
    before = {k: v.clone() for k, v in network.state_dict().items()}
    crop, box, K, photo = inputs
    output = network(("chest",), crop, box, K, photo)
    (
        output.found_box.sum() + sum(v.sum() for v in numbers(output.crops["chest"].raw).values())
    ).backward()
    taught = {k for k, p in network.trunk.named_parameters() if p.grad is not None}
    parameters = [k for k, _ in network.trunk.named_parameters()]
    kept = [k for k in parameters if k not in taught]
    assert kept == parameters[: len(kept)]  # from the picture's side on
    assert 0 < len(kept) < len(parameters)
    after = network.trunk.state_dict()
    statistics = [k for k in after if k.endswith("running_mean")]
    changed = [not torch.equal(after[k], before[f"trunk.{k}"]) for k in statistics]
    assert changed == sorted(changed)
    assert {True, False} == set(changed)
    maps, of_eval = network.trunk(photo), network.eval().trunk(photo)
    torch.testing.assert_close(maps[:2], of_eval[:2])
    assert not torch.allclose(maps[2], of_eval[2])


def test_nothing_in_a_frozen_trunk_is_left_to_chance(chest):
    network = make((chest,), frozen_to=32, backbone_options={"drop_path_rate": 0.5}).train()
    assert not any(layer.training for layer in network.trunk.modules())
    assert network.neck.training


def test_a_trunk_can_only_be_frozen_where_it_has_features(chest):
    with pytest.raises(ValueError, match="not 2"):
        make((chest,), frozen_to=2)


def test_the_confidence_does_not_teach_the_features(chest, inputs):
    image, box, K, photo = inputs
    network = make((chest,))
    output = network(("chest",), image, box, K, photo)
    output.crops["chest"].raw.confidence_logit.sum().backward()
    taught = {name.split(".")[0] for name, p in network.named_parameters() if p.grad is not None}
    assert taught == {"heads"}


def test_a_category_is_read_by_its_own_heads(cubes, chest, inputs):
    """Training one category's heads leaves what is said of the other."""
    image, box, K, photo = inputs
    network = make((cubes, chest)).eval()
    before = network(("cubes",), image, box, K, photo).crops["cubes"].raw
    with torch.no_grad():
        for parameter in network.heads["chest"].parameters():
            parameter.add_(1.0)
    after = network(("cubes",), image, box, K, photo).crops["cubes"].raw
    for name, value in numbers(before).items():
        assert torch.equal(value, numbers(after)[name]), name


def test_crops_do_not_see_each_other(cubes, inputs):
    image, box, K, photo = inputs
    network = make((cubes,)).eval()
    together = network(("cubes",), image, box, K, photo)
    expected = numbers(together.crops["cubes"].raw)
    for i in range(CROPS):
        alone = network(("cubes",), image[i : i + 1], box[i : i + 1], K[i : i + 1], photo[:1])
        for key, value in numbers(alone.crops["cubes"].raw).items():
            torch.testing.assert_close(value[0], expected[key][i], rtol=0, atol=1e-4)
    torch.testing.assert_close(alone.found_box[0], together.found_box[0], rtol=0, atol=1e-3)


def test_categories_asked_together_say_what_each_says_alone(cubes, chest, inputs):
    """Equally many crops of each, in the order of the names."""
    image, box, K, photo = inputs
    network = make((cubes, chest)).eval()
    twice = (torch.cat([image, image.flip(0)]), torch.cat([box, box.flip(0)]), torch.cat([K, K]))
    together = network(("chest", "cubes"), *twice, photo)
    assert list(together.crops) == ["chest", "cubes"]
    for name, alone in (
        ("chest", network(("chest",), image, box, K, photo)),
        ("cubes", network(("cubes",), image.flip(0), box.flip(0), K, photo)),
    ):
        expected, found = alone.crops[name], together.crops[name]
        for key, value in numbers(expected.raw).items():
            torch.testing.assert_close(numbers(found.raw)[key], value, rtol=0, atol=1e-4)
        dense = [vars(said.dense) | {"object": said.object_logits} for said in (found, expected)]
        for key, value in dense[1].items():
            torch.testing.assert_close(dense[0][key], value, rtol=0, atol=1e-4)
        torch.testing.assert_close(together.object_logits, alone.object_logits, rtol=0, atol=1e-4)
    with pytest.raises(ValueError, match="zip"):
        network(("chest", "cubes"), image, box, K, photo)  # three crops of two categories


def test_one_head_tells_where_the_object_is_whatever_its_category(cubes, chest, inputs):
    """In crops and photos alike, and in the crop as the exported file says it."""
    image, box, K, _ = inputs
    network = make((cubes, chest)).eval()
    output = network(("chest",), image, box, K, image)
    logits = output.crops["chest"].object_logits
    torch.testing.assert_close(output.object_logits, logits, rtol=0, atol=1e-5)
    as_cubes = network(("cubes",), image, box, K, image).crops["cubes"].object_logits
    torch.testing.assert_close(as_cubes, logits, rtol=0, atol=1e-5)
    share = network.object_mask(network.features(image)[0])
    torch.testing.assert_close(share, logits[:, 0].sigmoid(), rtol=0, atol=1e-5)
    assert share.std() > 0


def test_numbers_that_become_poses_are_float32_in_mixed_precision(cubes, inputs):
    image, box, K, photo = inputs
    with torch.autocast("cpu", torch.bfloat16):
        output = make((cubes,))(("cubes",), image, box, K, photo)
    of_crops = output.crops["cubes"]
    assert of_crops.dense.part_logits.dtype == torch.bfloat16  # the rest is cheap
    of_places = {k: v for k, v in vars(of_crops.dense).items() if k != "part_logits"}
    for key, value in (numbers(of_crops.raw) | of_places).items():
        assert value.dtype == torch.float32, key
    assert output.found_box.dtype == torch.float32


def test_cues_do_not_change_when_image_and_camera_are_resized_together(inputs):
    _, box, K, _ = inputs
    twice = K * torch.tensor([2.0, 2.0, 1.0])[:, None]
    torch.testing.assert_close(geometric_cues(2 * box, twice, 0.1), geometric_cues(box, K, 0.1))
