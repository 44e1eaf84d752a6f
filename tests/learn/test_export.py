"""The model file says what torch says, knows itself, and the run tier can use it."""

import json
from dataclasses import replace

import numpy as np
import onnx
import onnxruntime
import pytest
import torch

from r2art.core import prior_text
from r2art.core.camera import Camera
from r2art.core.errors import InputError, ModelError, UsageError
from r2art.core.image import crop_square
from r2art.learn import augment, checkpoint, exported, recipes
from r2art.learn.export import FIELDS, Graph, compact, export, output_names, to_onnx
from r2art.method.estimate import estimate, within_limits
from r2art.method.network import R2ArtNet
from r2art.run.predictor import load

S = 64
K = np.array([[[70.0, 0, 30], [0, 72, 33], [0, 0, 1]]], np.float32)


@pytest.fixture(scope="module")
def session(model_file):
    return onnxruntime.InferenceSession(model_file, providers=["CPUExecutionProvider"])


def feeds(n: int):
    rng = np.random.default_rng(0)
    for _ in range(n):
        corner = rng.uniform(2, 20, 2)
        box = np.array([[*corner, *(corner + rng.uniform(20, 40, 2))]], np.float32)
        yield {"image": rng.integers(0, 256, (1, S, S, 3), np.uint8), "K": K, "box": box}


def differences(network: R2ArtNet, session, feed) -> dict[str, float]:
    """Largest difference of every output, relative where it is beyond 1."""
    with torch.no_grad():
        expected = Graph(network, network.names)(
            *(torch.from_numpy(feed[k]) for k in ("image", "K", "box"))
        )
    names = [o.name for o in session.get_outputs()]
    assert names == output_names(network, network.names)
    actual = session.run(None, feed)
    found = {}
    for name, a, e in zip(names, actual, expected, strict=True):
        assert a.shape == tuple(e.shape)
        assert np.isfinite(a).all()
        found[name] = float((np.abs(a - e.numpy()) / np.maximum(1, np.abs(e.numpy()))).max())
    return found


def test_the_graph_computes_what_torch_does(run, photos):
    network, facts = checkpoint.load_network(run)
    graph = to_onnx(network, facts, tuple(photos[name].category for name in network.names))
    session = onnxruntime.InferenceSession(
        graph.SerializeToString(), providers=["CPUExecutionProvider"]
    )
    for feed in feeds(4):
        for name, difference in differences(network, session, feed).items():
            assert difference < 5e-5, name


def test_categories_that_are_left_out_are_nothing_known(run, session, tmp_path):
    export(run, tmp_path / "laptops.onnx", ["laptop"])
    predictor = load(tmp_path / "laptops.onnx")
    assert predictor.categories == ("laptop",)
    alone = onnxruntime.InferenceSession(
        tmp_path / "laptops.onnx", providers=["CPUExecutionProvider"]
    )
    names = [o.name for o in session.get_outputs()]
    for feed in feeds(3):
        whole = dict(zip(names, session.run(None, feed), strict=True))
        for output in alone.get_outputs():
            (found,) = alone.run([output.name], feed)
            if output.name == "category_scores":
                drawer, laptop, nothing = whole[output.name][0]
                expected = np.array([[laptop, drawer + nothing]])
            else:
                expected = whole[output.name]
            np.testing.assert_allclose(found, expected, atol=1e-5)
    with pytest.raises(UsageError, match="knows no giraffe; it knows drawer, laptop"):
        export(run, tmp_path / "none.onnx", ["giraffe"])
    with pytest.raises(UsageError, match="from a run"):
        export(tmp_path / "laptops.onnx", tmp_path / "none.onnx", ["laptop"])


def test_half_the_digits_of_large_weights_hardly_matter(run, session):
    network, _ = checkpoint.load_network(run)
    for feed in feeds(4):
        for name, difference in differences(network, session, feed).items():
            assert difference < 5e-3, name


def test_the_answer_is_that_of_the_method(run, session):
    """The file's names stand for the fields they say."""
    network, _ = checkpoint.load_network(run)
    feed = next(feeds(1))
    names = [o.name for o in session.get_outputs()]
    said = dict(zip(names, session.run(None, feed), strict=True))
    image, intrinsics, box = (torch.from_numpy(feed[k]) for k in ("image", "K", "box"))
    with torch.no_grad():
        dense, p16 = network.features(image.permute(0, 3, 1, 2).float() / 127.5 - 1)
        mask = network.object_mask(dense)
        assert said["object_mask"].shape == (1, S // 4, S // 4)
        np.testing.assert_allclose(said["object_mask"], mask, atol=2e-3)
        assert 0 <= said["object_mask"].min() < said["object_mask"].max() <= 1
        assert said["category_scores"].sum() == pytest.approx(1, abs=1e-5)
        np.testing.assert_allclose(said["found_box"], network.find(p16)[0], rtol=1e-3, atol=0.05)
        for name in network.names:
            raw = network.estimate_raw(name, p16, box, intrinsics)
            raw = replace(raw, joint_share=within_limits(raw.joint_share))
            found = estimate(network.priors[name], raw, box, intrinsics)
            expected = {
                "cam_T_part": found.cam_T_part,
                "box_center": found.shape.box_center,
                "box_size": found.shape.box_size,
                "confidence": raw.confidence_logit.sigmoid(),
                "joint_state": found.joint_state,
                "axis": found.axis,
                "pivot": found.pivot,
            }
            assert set(expected) == set(FIELDS)
            for field, value in expected.items():
                np.testing.assert_allclose(said[f"{name}.{field}"], value, rtol=2e-3, atol=1e-3)


def test_one_file_holds_it_all_and_is_small(model_file, photos):
    assert [p.name for p in model_file.parent.iterdir()] == [model_file.name]
    assert model_file.stat().st_size < 20e6
    model = onnx.load(model_file, load_external_data=False)
    assert not any(t.external_data for t in model.graph.initializer)
    stored = {t.data_type for t in model.graph.initializer if np.prod(t.dims) >= 4096}
    assert stored == {onnx.TensorProto.FLOAT16}
    recipe = recipes.tiny()
    shipped = R2ArtNet(
        tuple(p.category for p in photos.values()),
        recipe.backbone,
        recipe.input_size,
        recipe.width,
        recipe.backbone_options,
    )
    assert 2.1 * sum(p.numel() for p in shipped.parameters()) < 20e6


def test_the_metadata_is_what_the_run_tier_reads(model_file, session, photos):
    about = json.loads(session.get_modelmeta().custom_metadata_map["r2art"])
    assert about["format"] == "r2art/model/1"
    assert about["input_size"] == S
    assert about["crop_margin"] == augment.CROP_MARGIN == 1.25
    assert isinstance(about["version"], str)
    assert about["trained"]["recipe"]["steps"] == 30
    assert [c["name"] for c in about["categories"]] == sorted(photos)
    for described in about["categories"]:
        category = photos[described["name"]].category
        assert described["parts"] == list(category.part_names)
        for said, joint in zip(described["joints"], category.joints, strict=True):
            assert said == {
                "name": joint.name,
                "kind": joint.kind,
                "parent": joint.parent,
                "limits": list(joint.limits),
            }
    inputs = {i.name: (i.type, i.shape) for i in session.get_inputs()}
    assert inputs == {
        "image": ("tensor(uint8)", [1, S, S, 3]),
        "K": ("tensor(float)", ["views", 3, 3]),
        "box": ("tensor(float)", ["views", 4]),
    }


def test_the_file_holds_the_mean_object(model_file, photos):
    for known in load(model_file).model.categories:
        prior, category = known.prior(), photos[known.name].category
        assert prior.joints == category.joints
        every = -(-category.points.shape[1] // prior_text.POINTS)
        np.testing.assert_allclose(prior.points, category.points[:, ::every], atol=1e-3)
        np.testing.assert_array_equal(prior.box_size, category.box_size)
        damaged = replace(known, embedded=(known.embedded or "")[:200])
        with pytest.raises(ModelError, match="damaged"):
            damaged.prior()
        with pytest.raises(ModelError, match="export it again"):
            replace(known, embedded=None).prior()


def test_states_stay_within_their_limits_whatever_the_picture(model_file, session):
    about = json.loads(session.get_modelmeta().custom_metadata_map["r2art"])
    for feed in feeds(6):
        said = dict(
            zip([o.name for o in session.get_outputs()], session.run(None, feed), strict=True)
        )
        for category in about["categories"]:
            lower, upper = np.array([j["limits"] for j in category["joints"]]).T
            state = said[f"{category['name']}.joint_state"][0]
            assert np.all((state >= lower - 1e-6) & (state <= upper + 1e-6))
            confidence = said[f"{category['name']}.confidence"]
            assert np.all((confidence >= 0) & (confidence <= 1))


def test_the_predictor_says_what_the_network_says_of_the_crop(run, model_file, photos):
    predictor = load(model_file)
    network, _ = checkpoint.load_network(run)
    for name, some in photos.items():
        for i in range(3):
            (fx, _, cx), (_, fy, cy), _ = some.K[i].tolist()
            pixels, box = some.image[i].permute(1, 2, 0).numpy(), some.box[i].tolist()
            camera = Camera(fx, fy, cx, cy, pixels.shape[1], pixels.shape[0])
            said = predictor.predict(pixels, camera, name, box, refine=0)
            crop = crop_square(pixels, camera, box, S, augment.CROP_MARGIN)
            with torch.no_grad():
                expected = dict(
                    zip(
                        output_names(network, network.names),
                        Graph(network, network.names)(
                            torch.from_numpy(crop.pixels[None]),
                            torch.tensor(crop.camera.K[None], dtype=torch.float32),
                            torch.tensor([crop.from_photo(box)], dtype=torch.float32),
                        ),
                        strict=True,
                    )
                )
            for part, pose in zip(said.parts, expected[f"{name}.cam_T_part"][0], strict=True):
                np.testing.assert_allclose(part.cam_T_part, pose, atol=2e-3)
            for joint, state in zip(said.joints, expected[f"{name}.joint_state"][0], strict=True):
                assert joint.state == pytest.approx(float(state), abs=2e-3)


def test_the_run_tier_reads_where_the_object_is(run, model_file, photos):
    """Of the crop alone: the mask is the same whichever category is asked for."""
    model, (network, _) = load(model_file).model, checkpoint.load_network(run)
    assert model.segments
    pixels = photos["laptop"].image[0].permute(1, 2, 0).numpy()
    box = photos["laptop"].box[0].tolist()
    view = crop_square(pixels, Camera.from_fov(0.8, S, S), box, S, augment.CROP_MARGIN)
    with torch.no_grad():
        image = torch.from_numpy(view.pixels[None]).permute(0, 3, 1, 2).float() / 127.5 - 1
        (expected,) = network.object_mask(network.features(image)[0])
    for category in model.categories:
        found = model.pose(view, view.from_photo(box), category)
        assert found["object_mask"].shape == (S // 4, S // 4)
        np.testing.assert_allclose(found["object_mask"], expected, atol=5e-3)


def test_a_crop_is_seen_through_several_cameras_as_through_each(model_file, photos):
    model = load(model_file).model
    pixels = photos["laptop"].image[0].permute(1, 2, 0).numpy()
    box = photos["laptop"].box[0].tolist()
    cameras = [Camera.from_fov(fov, S, S) for fov in (1.0, 0.8, 0.6)]
    view = crop_square(pixels, cameras[0], box, S, augment.CROP_MARGIN)
    seen = [view.through(camera).camera for camera in cameras]
    for category in model.categories:
        together = model.poses(view, view.from_photo(box), category, seen)
        for found, camera in zip(together, cameras, strict=True):
            alone = model.pose(view.through(camera), view.from_photo(box), category)
            assert found.keys() == alone.keys()
            for name, value in alone.items():
                np.testing.assert_allclose(found[name], value, atol=1e-4, err_msg=name)
        assert together[0]["cam_T_part"][0, 2, 3] != together[1]["cam_T_part"][0, 2, 3]


def test_the_predictor_finds_and_names_without_help(model_file, photos):
    predictor = load(model_file)
    image = photos["laptop"].image[0].permute(1, 2, 0).numpy()
    said = predictor.predict(image, Camera.from_fov(0.8, 64, 64))
    assert said.category in photos
    assert 0 < said.category_score <= 1
    assert np.isfinite(said.box).all()
    assert said.parts[0].cam_T_part[2, 3] > 0


def test_exporting_without_a_run_or_a_place_gives_one_clear_error(run, tmp_path):
    with pytest.raises(ModelError, match="holds no trained run"):
        export(tmp_path, tmp_path / "model.onnx")
    with pytest.raises(InputError, match="cannot write"):
        export(run, tmp_path / "none" / "model.onnx")


def test_weights_as_bytes_are_a_quarter_as_large_and_nearly_the_same(run, photos, tmp_path):
    network, facts = checkpoint.load_network(run)
    whole = to_onnx(network, facts, tuple(photos[name].category for name in network.names))
    own = f"{exported.PREFIX}heads.laptop."
    paths = {"halves": compact(whole), "bytes": compact(whole, [own])}
    for name, model in paths.items():
        onnx.checker.check_model(model)
        (tmp_path / name).write_bytes(model.SerializeToString())
    large = sum(np.prod(t.dims) for t in whole.graph.initializer if t.name.startswith(own))
    saved = (tmp_path / "halves").stat().st_size - (tmp_path / "bytes").stat().st_size
    assert 0.8 * large < saved < large
    truth = {t.name: onnx.numpy_helper.to_array(t) for t in whole.graph.initializer}
    for name, weight in exported.weights(tmp_path / "bytes").items():
        value = truth[exported.PREFIX + name]
        if name.startswith("heads.laptop.") and value.size >= 4096:
            rest = tuple(range(1, value.ndim))
            step = np.abs(value).max(axis=rest, keepdims=True) / 127
            assert (np.abs(weight.numpy() - value) <= 0.501 * step + 1e-7).all(), name
        else:
            np.testing.assert_allclose(weight, value, rtol=1e-3, atol=1e-6)
    says = [
        onnxruntime.InferenceSession(tmp_path / name, providers=["CPUExecutionProvider"])
        for name in paths
    ]
    for feed in feeds(2):
        one, other = (s.run(["laptop.cam_T_part"], feed)[0] for s in says)
        np.testing.assert_allclose(one, other, atol=0.02)
