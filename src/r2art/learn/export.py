"""A trained run as one self-contained ONNX file: pixels in, part poses out.

The whole tail (Gram-Schmidt, projection depth, kinematics, boxes) is inside the graph, so the
run tier repeats no mathematics. Large weights are stored as float16, those of known objects as
bytes, and widened on loading.
"""

import json
import warnings
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import jaxtyping
import numpy as np
import onnx
import torch
from jaxtyping import Float, UInt8
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor, nn

from r2art.core import prior_text
from r2art.core.category import Category
from r2art.core.errors import UsageError
from r2art.data.categories import CATEGORIES, with_symmetries
from r2art.data.objects import Procedural
from r2art.data.prior import with_mesh
from r2art.data.shards import write_atomically
from r2art.learn import checkpoint, exported
from r2art.learn.augment import CROP_MARGIN
from r2art.learn.exported import BYTES, HALF, SCALE
from r2art.learn.on_demand import is_on_demand, on_demand
from r2art.method.estimate import estimate, within_limits
from r2art.method.outputs import Network

FORMAT = "r2art/model/1"
OPSET = 18
FIELDS = ("cam_T_part", "box_center", "box_size", "confidence", "joint_state", "axis", "pivot")
KEYPOINT_FIELDS = ("keypoint", "keypoint_deviation")
"""Besides, of known objects."""
MASK = "object_mask"
"""One more output, of networks that tell where the object is seen."""


class Graph(nn.Module):
    """What is exported: `docs/model.md` names its inputs and outputs.

    Args:
        network: Whatever its pose heads.
        names: The categories to export; what looks like another is nothing known.
    """

    def __init__(self, network: Network, names: tuple[str, ...]) -> None:
        super().__init__()
        self.network, self.names = network, names

    def forward(
        self,
        image: UInt8[Tensor, "1 S S 3"],
        K: Float[Tensor, "V 3 3"],
        box: Float[Tensor, "V 4"],
    ) -> tuple[Tensor, ...]:
        """All outputs, in the order of `output_names`, of one image through V cameras."""
        x = image.permute(0, 3, 1, 2).float() / 127.5 - 1
        dense, seen = self.network.features(x)
        found_box, category_logits = self.network.find(seen)
        known = [self.network.names.index(name) for name in self.names]
        scores = category_logits.softmax(dim=-1)[:, known]
        nothing = (1 - scores.sum(dim=-1, keepdim=True)).clamp(min=0)
        outputs = [found_box, torch.cat([scores, nothing], dim=-1)]
        for name in self.names:
            outputs += self._estimate(name, seen, K, box)
            if (keypoints := self.network.keypoints(name, seen)) is not None:
                outputs += [keypoints.uv, keypoints.log_deviation.exp()]
        if (mask := self.network.object_mask(dense)) is not None:
            outputs.append(mask)
        return tuple(outputs)

    def _estimate(self, name: str, seen: Any, K: Tensor, box: Tensor) -> list[Tensor]:
        raw = self.network.estimate_raw(name, seen, box, K)
        raw = replace(raw, joint_share=within_limits(raw.joint_share))
        found = estimate(self.network.priors[name], raw, box, K)
        return [
            found.cam_T_part,
            found.shape.box_center,
            found.shape.box_size,
            raw.confidence_logit.sigmoid(),
            found.joint_state,
            found.axis,
            found.pivot,
        ]


def output_names(network: Network, names: tuple[str, ...]) -> list[str]:
    """Names of the graph's outputs, for these categories."""
    segments = type(network).object_mask is not Network.object_mask
    known = [name for name in names if network.priors[name].keypoints is not None]
    groups = demands(names, known if network.finds_keypoints else (), segments=segments)
    return ["found_box", "category_scores", *(output for group in groups for output in group)]


def demands(
    names: Sequence[str], known: Collection[str] = (), *, segments: bool
) -> list[list[str]]:
    """The outputs that are asked for together: of every category, and last the object's mask.

    Args:
        names: Of all categories ...
        known: ... and of those with keypoints.
        segments: Whether there is a mask.
    """
    of_categories = [
        [f"{name}.{field}" for field in FIELDS + KEYPOINT_FIELDS * (name in known)]
        for name in names
    ]
    return of_categories + [[MASK]] * segments


def to_onnx(
    network: Network, facts: dict[str, Any], categories: tuple[Category, ...]
) -> onnx.ModelProto:
    """The network with its tail as an ONNX model of these categories, all weights float32.

    What it estimates of a category is computed on demand, see `r2art.learn.on_demand`.
    """
    size, names = network.input_size, tuple(c.name for c in categories)
    example = (
        torch.zeros((1, size, size, 3), dtype=torch.uint8),
        torch.tensor([[200.0, 0, size / 2], [0, 200.0, size / 2], [0, 0, 1]]).expand(2, 3, 3),
        (torch.tensor([0.2, 0.2, 0.8, 0.8]) * size).expand(2, 4),
    )
    views = torch.export.Dim("views")
    with warnings.catch_warnings(), _unchecked_shapes():
        warnings.simplefilter("ignore")
        program = torch.onnx.export(
            Graph(network, names).eval(),
            example,
            input_names=["image", "K", "box"],
            output_names=output_names(network, names),
            dynamic_shapes=({}, {0: views}, {0: views}),
            opset_version=OPSET,
            dynamo=True,
            optimize=True,
            verbose=False,
        )
    assert program is not None
    model = program.model_proto
    del model.metadata_props[:]
    meta = model.metadata_props.add()
    meta.key, meta.value = "r2art", json.dumps(metadata(network, facts, categories))
    return by_category(model)


def by_category(model: onnx.ModelProto) -> onnx.ModelProto:
    """A model of r2art, with what it estimates of a category computed on demand."""
    if is_on_demand(model):
        return model
    names = [described["name"] for described in exported.metadata(model)["categories"]]
    made = {output.name for output in model.graph.output}
    known = [name for name in names if f"{name}.{KEYPOINT_FIELDS[0]}" in made]
    return on_demand(model, demands(names, known, segments=MASK in made))


@contextmanager
def _unchecked_shapes() -> Iterator[None]:
    """No checks of annotated shapes: they would fix the number of cameras to the example's."""
    before = jaxtyping.config.jaxtyping_disable
    jaxtyping.config.update("jaxtyping_disable", True)
    try:
        yield
    finally:
        jaxtyping.config.update("jaxtyping_disable", before)


def metadata(
    network: Network, facts: dict[str, Any], categories: tuple[Category, ...]
) -> dict[str, Any]:
    """What the run tier must know about the graph."""
    described = [
        {
            "name": c.name,
            "size_spread": c.size_spread,
            "has_keypoints": network.finds_keypoints and c.keypoints is not None,
            "prior": prior_text.to_text(c),
            "parts": list(c.part_names),
            "joints": [
                {"name": j.name, "kind": j.kind, "parent": j.parent, "limits": list(j.limits)}
                for j in c.joints
            ],
        }
        for c in categories
    ]
    return {
        "format": FORMAT,
        "input_size": network.input_size,
        "crop_margin": CROP_MARGIN,
        "categories": described,
        "version": "1",
        "trained": facts,
    }


def compact(
    model: onnx.ModelProto, in_bytes: Sequence[str] = (), least: int = 4096
) -> onnx.ModelProto:
    """A model whose large weights take less room, widened when a session starts.

    Args:
        model: With float32 weights.
        in_bytes: Weights whose names begin so become bytes with a scale for each row, which is off
            by up to a 250th of the row's largest; all others float16.
        least: Numbers in a weight that is large.
    """
    stored = onnx.ModelProto()
    stored.CopyFrom(model)
    graph = stored.graph
    nodes: list[onnx.NodeProto] = []
    scales: list[TensorProto] = []
    for tensor in graph.initializer:
        if tensor.data_type != TensorProto.FLOAT or np.prod(tensor.dims) < least:
            continue
        name, value = tensor.name, numpy_helper.to_array(tensor)
        if not name.startswith(tuple(in_bytes)):
            half = value.astype(np.float16)
            tensor.CopyFrom(numpy_helper.from_array(half, name + HALF))
            nodes.append(helper.make_node("Cast", [name + HALF], [name], to=TensorProto.FLOAT))
            continue
        whole, scale = exported.as_bytes(value)
        tensor.CopyFrom(numpy_helper.from_array(whole, name + BYTES))
        scales.append(numpy_helper.from_array(scale, name + SCALE))
        wide = f"{name}_wide"
        nodes.append(helper.make_node("Cast", [name + BYTES], [wide], to=TensorProto.FLOAT))
        nodes.append(helper.make_node("Mul", [wide, name + SCALE], [name]))
    graph.initializer.extend(scales)
    nodes.extend(graph.node)
    del graph.node[:]
    graph.node.extend(nodes)
    return stored


def complete(category: Category) -> Category:
    """A category with its mesh and its symmetries, as far as they are known.

    Data sets of before priors had them lack them; where the category is one that r2art makes,
    its objects can be made again.
    """
    category = with_symmetries(category)
    if category.mesh is not None or category.name not in CATEGORIES:
        return category
    return with_mesh(category, list(Procedural(category.name).typical()))


def completed(model: onnx.ModelProto) -> onnx.ModelProto:
    """The same model as today's would be: with complete priors, its categories on demand."""
    about = exported.metadata(model)
    for described in about["categories"]:
        if text := described.get("prior"):
            described["prior"] = prior_text.to_text(complete(prior_text.from_text(text)))
    return by_category(exported.with_metadata(model, about))


def export(
    run: Path,
    out: Path,
    names: Sequence[str] = (),
    blend: Path | None = None,
    finding_for: Path | None = None,
) -> None:
    """Write the averaged network of a run as ``out``.

    Args:
        run: Of training; or a model file, which is written again as `completed`.
        out: The model file.
        names: Of the categories it shall know; none: all.
        blend: A model file, to whose weights the run's are brought halfway.
        finding_for: A model file, of which only what finds objects is replaced by the run's.

    Raises:
        UsageError: The run knows no category of such a name; or what is asked for does not go
            together.
        ModelError: ``blend`` or ``finding_for`` does not fit, see `r2art.learn.exported`.
    """
    if run.is_file() and names:
        raise UsageError(f"categories can be chosen from a run, not from the model file {run}")
    if run.is_file() and (blend or finding_for):
        raise UsageError(f"a model goes together with a run, not with the model file {run}")
    if blend and finding_for:
        raise UsageError("give one of --blend and --finding-for")
    if run.is_file():
        write_atomically(out, completed(exported.read_model(run)).SerializeToString())
        return
    network, facts = checkpoint.load_network(run)
    facts = {"recipe": facts["recipe"], "data": facts["data"]}
    if odd := sorted(set(names) - set(network.names)):
        raise UsageError(f"{run} knows no {', '.join(odd)}; it knows {', '.join(network.names)}")
    chosen = [name for name in network.names if not names or name in names]
    categories = tuple(complete(Category.load(run / f"{name}.npz")) for name in chosen)
    if blend is not None:
        facts["blend"] = exported.facts(blend)
    model = to_onnx(network, facts, categories)
    if blend is not None:
        model = exported.blended(model, blend)
    known = [c.name for c in categories if c.keypoints is not None and network.finds_keypoints]
    own = ["known_objects.", *(f"heads.{name}." for name in known)]
    model = compact(model, [exported.PREFIX + name for name in own])
    if finding_for is not None:
        model = exported.with_finding_of(model, finding_for)
    onnx.checker.check_model(model)
    write_atomically(out, model.SerializeToString())
