"""The 3D scene says what the prediction says; trimesh, which did not write it, is the judge."""

import io

import numpy as np
import pytest
import trimesh

from r2art.core.camera import Camera
from r2art.run.export.glb import to_glb

GLTF_T_OPENCV = np.diag([1, -1, -1, 1])


@pytest.fixture(params=["laptop", "drawer"])
def prediction(request, predictor, pixels):
    camera = Camera(300, 300, 160, 120, 320, 240)
    return predictor.predict(pixels, camera, request.param, (60, 40, 240, 210))


@pytest.fixture
def scene(prediction):
    return trimesh.load_scene(io.BytesIO(to_glb(prediction)), file_type="glb")


def test_every_part_is_a_node_posed_as_predicted(prediction, scene):
    for part in prediction.parts:
        pose, _ = scene.graph.get(part.name, "world")
        np.testing.assert_allclose(pose, GLTF_T_OPENCV @ part.cam_T_part, atol=1e-5)


def test_every_parts_solid_is_its_box(prediction, scene):
    for part in prediction.parts:
        solid = scene.geometry[part.name]
        low, high = (part.box_center + s * part.box_size / 2 for s in (-1, 1))
        np.testing.assert_allclose(solid.bounds, [low, high], atol=1e-6)
        assert solid.volume == pytest.approx(np.prod(part.box_size), rel=1e-4)
        outward = ((solid.vertices - part.box_center) * solid.vertex_normals).sum(axis=1)
        assert (outward > 0).all()


def test_every_joint_is_an_arrow_along_its_axis(prediction, scene):
    for joint in prediction.joints:
        pose, name = scene.graph.get(joint.name, "world")
        flip = GLTF_T_OPENCV[:3, :3]
        np.testing.assert_allclose(pose[:3, 3], flip @ joint.pivot, atol=1e-5)
        np.testing.assert_allclose(pose[:3, 2], flip @ joint.axis, atol=1e-5)
        arrow = scene.geometry[name]
        assert arrow.volume > 0
        assert arrow.bounds[0, 2] == pytest.approx(0, abs=1e-6)


def test_the_scene_is_the_same_bytes_every_time(prediction):
    assert to_glb(prediction) == to_glb(prediction)
