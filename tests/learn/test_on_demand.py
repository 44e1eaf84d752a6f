"""What is not asked for is not computed, and what is comes out as it was."""

import json

import numpy as np
import onnx
import onnxruntime
import pytest
from onnx import TensorProto, helper, numpy_helper

from r2art.learn.export import by_category, demands
from r2art.learn.exported import metadata
from r2art.learn.on_demand import ASKED, is_on_demand, on_demand


def value(name: str, *dims: int | str) -> onnx.ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, list(dims))


def session_of(model: onnx.ModelProto) -> onnxruntime.InferenceSession:
    onnx.checker.check_model(model)
    return onnxruntime.InferenceSession(
        model.SerializeToString(), providers=["CPUExecutionProvider"]
    )


@pytest.fixture
def family() -> onnx.ModelProto:
    """Three outputs: one for all, two that share a node, which is no output itself."""
    nodes = [
        helper.make_node("Mul", ["two", "two"], ["four"]),  # known from weights alone
        helper.make_node("Mul", ["x", "four"], ["always"]),
        helper.make_node("Add", ["always", "two"], ["shared"]),
        helper.make_node("Sqrt", ["shared"], ["root"]),
        helper.make_node("Neg", ["shared"], ["minus"]),
        helper.make_node("Mul", ["minus", "four"], ["much"]),
        helper.make_node("Neg", ["root"], ["for_nobody"]),
    ]
    graph = helper.make_graph(
        nodes,
        "family",
        [value("x", "n", 3)],
        [value("always", "n", 3), value("root", "n", 3), value("much", "n", 3)],
        [numpy_helper.from_array(np.float32([2]), "two")],
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)


X = np.float32([[0, 1, 2], [3, 4, 5]])


@pytest.mark.parametrize("asked", [(True, True), (True, False), (False, True), (False, False)])
def test_what_is_asked_for_is_as_it_was_and_the_rest_is_empty(family, asked):
    expected = session_of(family).run(None, {"x": X})
    changed = session_of(on_demand(family, [["root"], ["much"]]))
    found = changed.run(None, {"x": X, ASKED: np.array(asked)})
    for is_there, before, after in zip((True, *asked), expected, found, strict=True):
        assert after.shape == (before.shape if is_there else (0, 3))
        if is_there:
            np.testing.assert_array_equal(after, before)


def test_everything_is_asked_for_by_those_who_do_not_know_how(family):
    changed = session_of(on_demand(family, [["root"], ["much"]]))
    for before, after in zip(
        session_of(family).run(None, {"x": X}), changed.run(None, {"x": X}), strict=True
    ):
        np.testing.assert_array_equal(after, before)


def test_each_branch_holds_what_its_groups_alone_need(family):
    graph = on_demand(family, [["root"], ["much"]]).graph
    branches = {
        n.name: [
            inner.op_type for a in n.attribute if a.name == "then_branch" for inner in a.g.node
        ]
        for n in graph.node
        if n.op_type == "If"
    }
    assert branches == {"asked_0_1": ["Add"], "asked_0": ["Sqrt"], "asked_1": ["Neg", "Mul"]}
    assert [n.output[0] for n in graph.node][:2] == ["four", "always"]


def test_no_length_is_promised_of_what_may_be_empty(family):
    """ONNX Runtime reuses memory by stated shapes, and falls over an empty value in it."""
    stated = helper.make_model(
        helper.make_graph(
            family.graph.node,
            "stated",
            [value("x", 2, 3)],
            [value("always", 2, 3), value("root", 2, 3), value("much", 2, 3)],
            family.graph.initializer,
            value_info=[value("shared", 2, 3), value("minus", 2, 3)],
        ),
        opset_imports=family.opset_import,
        ir_version=9,
    )
    graph = on_demand(stated, [["root"], ["much"]]).graph
    assert "shared" not in [v.name for v in graph.value_info]
    lengths = {o.name: o.type.tensor_type.shape.dim[0].dim_value for o in graph.output}
    assert lengths == {"always": 2, "root": 0, "much": 0}


def test_the_model_given_stays_as_it_was(family):
    before = family.SerializeToString()
    assert is_on_demand(on_demand(family, [["root"]]))
    assert family.SerializeToString() == before
    assert not is_on_demand(family)


def test_an_exported_model_estimates_the_category_that_is_asked_for(model_file):
    model = onnx.load(model_file)
    assert is_on_demand(model)
    assert by_category(model) is model
    names = [c["name"] for c in metadata(model)["categories"]]
    groups = demands(names, segments=True)
    session = session_of(model)
    size = json.loads(session.get_modelmeta().custom_metadata_map["r2art"])["input_size"]
    feed = {
        "image": np.random.default_rng(0).integers(0, 256, (1, size, size, 3), np.uint8),
        "K": np.float32([[[70, 0, 30], [0, 72, 33], [0, 0, 1]]]),
        "box": np.float32([[4, 6, 50, 60]]),
    }
    outputs = [o.name for o in session.get_outputs()]
    whole = dict(zip(outputs, session.run(None, feed), strict=True))
    for k, group in enumerate(groups):
        asked = np.arange(len(groups)) == k
        found = dict(zip(outputs, session.run(None, feed | {ASKED: asked}), strict=True))
        for name in outputs:
            if name in group or name in ("found_box", "category_scores"):
                np.testing.assert_allclose(found[name], whole[name], rtol=1e-5, atol=1e-6)
            else:
                assert found[name].shape == (0, *whole[name].shape[1:]), name
