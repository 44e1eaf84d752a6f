"""Parts of an ONNX graph that run only when they are asked for.

ONNX Runtime computes every output of a graph, whichever of them are fetched; a model of eight
categories would estimate eight objects in every crop. Here what only some groups of outputs need
goes into the branch of an `If`.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import onnx
from onnx import GraphProto, NodeProto, TensorProto, ValueInfoProto, helper, numpy_helper

ASKED = "asked"
"""The new input: a bool for each group of outputs, all true where it is not given."""


def on_demand(model: onnx.ModelProto, groups: Sequence[Iterable[str]]) -> onnx.ModelProto:
    """The same model with one more input, `ASKED`, that says which outputs to compute.

    Args:
        model: Of ONNX; weights and what is computed from weights alone stay where they are.
        groups: Of output names. Those of a group that is not asked for are empty; outputs in no
            group are always computed.

    Returns:
        A new model, whose groups are asked for unless the caller says otherwise.
    """
    result = onnx.ModelProto()
    result.CopyFrom(model)
    graph = result.graph
    members = _by_need(graph, groups)
    kinds = _kinds(model)
    graph.input.append(helper.make_tensor_value_info(ASKED, TensorProto.BOOL, [len(groups)]))
    everything = np.ones(len(groups), bool)
    graph.initializer.append(numpy_helper.from_array(everything, ASKED))
    always = members.pop(frozenset(), [])
    conditional: set[str] = set()
    del graph.node[:]
    graph.node.extend(always)
    # What more groups need comes first: it is needed for what fewer need.
    for needed_by in sorted(members, key=lambda s: (-len(s), sorted(s))):
        nodes = members[needed_by]
        outside = [n for s, others in members.items() if s != needed_by for n in others]
        wanted = {name for n in (*always, *outside) for name in n.input}
        wanted |= {o.name for o in graph.output}
        made = [name for n in nodes for name in n.output if name in wanted]
        graph.node.extend(_branch(sorted(needed_by), nodes, [kinds[name] for name in made]))
        conditional |= set(made)
    _forget_lengths(graph, conditional)
    return result


def is_on_demand(model: onnx.ModelProto) -> bool:
    """Whether that has been done to a model."""
    return any(given.name == ASKED for given in model.graph.input)


def _by_need(
    graph: GraphProto, groups: Sequence[Iterable[str]]
) -> dict[frozenset[int], list[NodeProto]]:
    """Nodes by the groups that need them, in the graph's order; under none, what is always run."""
    group_of = {name: g for g, names in enumerate(groups) for name in names}
    constant = {t.name for t in graph.initializer} | {""}
    fixed: set[str] = set()  # outputs of nodes that stay where they are
    for node in graph.node:
        if constant.issuperset(node.input):
            constant |= set(node.output)
            fixed |= set(node.output)
    needs: dict[str, set[int]] = defaultdict(set)
    for output in graph.output:
        if output.name in group_of:
            needs[output.name].add(group_of[output.name])
        else:
            fixed.add(output.name)
    members: dict[frozenset[int], list[NodeProto]] = defaultdict(list)
    for node in reversed(graph.node):
        if fixed.isdisjoint(node.output):
            needed_by = frozenset[int]().union(*(needs[name] for name in node.output))
            if not needed_by:  # by nothing at all
                continue
        else:
            needed_by = frozenset[int]()
            fixed |= set(node.input)
        for name in node.input:
            needs[name] |= needed_by
        members[needed_by].append(node)
    return {needed_by: nodes[::-1] for needed_by, nodes in members.items()}


def _forget_lengths(graph: GraphProto, names: set[str]) -> None:
    """Let values be empty: a runtime relies on the lengths that are stated."""
    stated = [v for v in graph.value_info if v.name not in names]
    del graph.value_info[:]
    graph.value_info.extend(stated)
    for output in graph.output:
        shape = output.type.tensor_type.shape
        if output.name in names and shape.dim and shape.dim[0].HasField("dim_value"):
            shape.dim[0].Clear()


def _kinds(model: onnx.ModelProto) -> dict[str, ValueInfoProto]:
    """Type of every value of a model."""
    graph = onnx.shape_inference.infer_shapes(model).graph
    return {v.name: v for v in (*graph.value_info, *graph.output)}


def _branch(
    needed_by: Sequence[int], nodes: Sequence[NodeProto], made: Sequence[ValueInfoProto]
) -> list[NodeProto]:
    """An `If` that runs the nodes where one of the groups is asked for, and what decides it."""
    name = f"{ASKED}_{'_'.join(map(str, needed_by))}"
    index, bits, ints, most, any_of = (
        f"{name}_{k}" for k in ("index", "bits", "ints", "most", "any")
    )
    hidden = {v.name: f"{name}/{v.name}" for v in made}  # an outer name must not be made within
    inner = [_renamed(node, hidden) for node in nodes]
    computed = [helper.make_value_info(hidden[v.name], v.type) for v in made]
    nothing = [_nothing(v, f"{name}/none/{v.name}") for v in made]
    empty = [helper.make_node("Constant", [], [t.name], value=t) for t in nothing]
    absent = [helper.make_tensor_value_info(t.name, t.data_type, list(t.dims)) for t in nothing]
    return [
        helper.make_node(
            "Constant", [], [index], value=numpy_helper.from_array(np.array(needed_by), index)
        ),
        helper.make_node("Gather", [ASKED, index], [bits]),
        helper.make_node("Cast", [bits], [ints], to=TensorProto.INT32),
        helper.make_node("ReduceMax", [ints], [most], keepdims=0),
        helper.make_node("Cast", [most], [any_of], to=TensorProto.BOOL),
        helper.make_node(
            "If",
            [any_of],
            [v.name for v in made],
            name=name,
            then_branch=helper.make_graph(inner, f"{name}_then", [], computed),
            else_branch=helper.make_graph(empty, f"{name}_else", [], absent),
        ),
    ]


def _renamed(node: NodeProto, names: Mapping[str, str]) -> NodeProto:
    """A node whose inputs and outputs have other names."""
    result = NodeProto()
    result.CopyFrom(node)
    for field in (result.input, result.output):
        field[:] = [names.get(name, name) for name in field]
    return result


def _nothing(kind: ValueInfoProto, name: str) -> TensorProto:
    """No values of a kind: the first dimension is 0."""
    of = kind.type.tensor_type
    dims = [d.dim_value for d in of.shape.dim] or [0]
    dtype = helper.tensor_dtype_to_np_dtype(of.elem_type)
    return numpy_helper.from_array(np.zeros([0, *dims[1:]], dtype), name)
