"""Animations of the 3D scene, played by a reader that knows glTF's rules and nothing of r2art."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from r2art.run.export import FORMATS

KINDS = {5126: ("<f4", 4), 5123: ("<u2", 2)}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
GLTF_T_OPENCV = np.diag([1, -1, -1, 1])


class Player:
    """A glTF file of which any animations play at once."""

    def __init__(self, glb):
        magic, version, size = struct.unpack_from("<4sII", glb)
        assert (magic, version, size) == (b"glTF", 2, len(glb))
        length, kind = struct.unpack_from("<I4s", glb, 12)
        assert kind == b"JSON"
        assert length % 4 == 0
        self.document = json.loads(glb[20 : 20 + length])
        _, kind = struct.unpack_from("<I4s", glb, 20 + length)
        assert kind == b"BIN\0"
        self.binary = glb[28 + length :]
        assert len(self.binary) == self.document["buffers"][0]["byteLength"]
        self.animations = {a["name"]: a for a in self.document.get("animations", [])}
        self.parents = {}
        for i, node in enumerate(self.document["nodes"]):
            for child in node.get("children", []):
                assert child not in self.parents, "a node hangs in two places"
                self.parents[child] = i

    def array(self, index):
        accessor = self.document["accessors"][index]
        view = self.document["bufferViews"][accessor["bufferView"]]
        dtype, width = KINDS[accessor["componentType"]]
        assert view["byteOffset"] % width == 0
        count = accessor["count"] * WIDTHS[accessor["type"]]
        rows = np.frombuffer(self.binary, dtype, count, view["byteOffset"])
        assert rows.nbytes == view["byteLength"]
        rows = rows.reshape(accessor["count"], -1)
        if "min" in accessor:
            np.testing.assert_array_equal(rows.min(axis=0), np.float32(accessor["min"]))
            np.testing.assert_array_equal(rows.max(axis=0), np.float32(accessor["max"]))
        return rows

    def keys(self, name):
        """The node, path, times and values of an animation."""
        (channel,) = self.animations[name]["channels"]
        sampler = self.animations[name]["samplers"][channel["sampler"]]
        assert sampler["interpolation"] == "LINEAR"
        assert "min" in self.document["accessors"][sampler["input"]]
        seconds, values = self.array(sampler["input"])[:, 0], self.array(sampler["output"])
        assert (np.diff(seconds) > 0).all()
        return channel["target"]["node"], channel["target"]["path"], seconds, values

    def poses(self, names, seconds):
        """World poses of nodes while animations, by name, stand at these seconds."""
        moved = self.moved(seconds)
        index = {node["name"]: i for i, node in enumerate(self.document["nodes"])}
        return np.stack([self.world(index[name], moved) for name in names])

    def moved(self, seconds):
        """What the animations give: node to path to value."""
        moved = {}
        for animation, now in seconds.items():
            node, path, times, values = self.keys(animation)
            if path == "rotation":
                value = Slerp(times, Rotation.from_quat(values))(now).as_quat()
            else:
                value = [np.interp(now, times, v) for v in values.T]
            moved.setdefault(node, {})[path] = value
        return moved

    def world(self, at, moved):
        pose = np.eye(4)
        while at is not None:
            pose = self.local(at, moved.get(at, {})) @ pose
            at = self.parents.get(at)
        return pose

    def local(self, index, moved):
        node = self.document["nodes"][index]
        if "matrix" in node:
            assert not moved, "what moves must not have a matrix"
            return np.reshape(node["matrix"], (4, 4)).T
        pose = np.eye(4)
        rotation = moved.get("rotation", node.get("rotation", [0, 0, 0, 1]))
        pose[:3, :3] = Rotation.from_quat(rotation).as_matrix()
        pose[:3, 3] = moved.get("translation", node.get("translation", [0, 0, 0]))
        return pose


@pytest.fixture
def player(prediction):
    return Player(FORMATS["glb"].encode(prediction))


def test_the_matrix_of_each_parts_node_is_its_pose(prediction, player):
    nodes = {node["name"]: node for node in player.document["nodes"]}
    for part in prediction.parts:
        matrix = np.reshape(nodes[part.name]["matrix"], (4, 4)).T
        np.testing.assert_array_equal(matrix, part.cam_T_part)
    seen = np.stack([part.cam_T_part for part in prediction.parts])
    names = [part.name for part in prediction.parts]
    np.testing.assert_allclose(player.poses(names, {}), GLTF_T_OPENCV @ seen, atol=1e-9)
    for joint in prediction.joints:
        place = np.array(nodes[joint.name]["translation"])
        z = Rotation.from_quat(nodes[joint.name]["rotation"]).as_matrix()[:, 2]
        np.testing.assert_allclose([place, z], [joint.pivot, joint.axis], atol=1e-9)


def test_each_animation_takes_its_joint_from_limit_to_limit_and_back(mechanism, prediction, player):
    """Everything further out moves along, and nothing else does."""
    names = [part.name for part in prediction.parts]
    assert list(player.animations) == [joint.name for joint in prediction.joints]
    present = np.array([joint.state for joint in prediction.joints])
    for j, joint in enumerate(prediction.joints):
        low, high = joint.limits
        for now in (0, 0.7, 2, 3.1, 4):
            states = present.copy()
            states[j] = low + (high - low) * (now if now <= 2 else 4 - now) / 2
            found = player.poses(names, {joint.name: now})
            expected = GLTF_T_OPENCV @ mechanism.poses(states)
            np.testing.assert_allclose(found, expected, atol=1e-5)


def test_all_animations_may_play_at_once(mechanism, prediction, player, rng):
    seconds = {joint.name: rng.uniform(0, 2) for joint in prediction.joints}
    share = np.array(list(seconds.values())) / 2
    states = mechanism.limits[:, 0] + share * np.diff(mechanism.limits).ravel()
    found = player.poses([part.name for part in prediction.parts], seconds)
    np.testing.assert_allclose(found, GLTF_T_OPENCV @ mechanism.poses(states), atol=2e-5)


def test_a_joint_without_room_has_no_animation(prediction):
    joints = tuple(replace(j, limits=(j.state, j.state)) for j in prediction.joints)
    player = Player(FORMATS["glb"].encode(replace(prediction, joints=joints)))
    assert not player.animations
    for accessor in range(len(player.document["accessors"])):
        assert np.isfinite(player.array(accessor)).all()
