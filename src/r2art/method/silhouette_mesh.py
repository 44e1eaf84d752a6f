"""Silhouettes of closed meshes: the exact share of every pixel that is covered.

The faces that a camera sees from the front add up to layers L, 1 or more within the silhouette of
a closed mesh, and min(L, 1) is covered. The edges at which they end say all of it: a piece of an
edge in a cell adds the area to its right, and a running sum along the row carries it on. The
derivative is a boundary integral: what a moving edge sweeps, in cells not wholly covered.

It is what `r2art.run.refinement.coverage` does without torch; a test holds both together.
Edges are cut in double precision. Letters: N edges on outlines, C pieces of them.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import torch
from jaxtyping import Float, Int
from torch import Tensor
from torch.autograd.function import once_differentiable

from r2art.core.mesh import Mesh
from r2art.method.projection import MIN_DEPTH, project
from r2art.method.shape import Shape
from r2art.method.silhouette import Silhouettes

FINER = 3
"""Cells along a pixel's side. Layers are cut off at 1 in every cell: where two edges of layers
one behind the other share a cell, as those of a thin wall do, it counts as covered too much."""
FULL = 1 - 1e-9
"""Layers of a cell that is wholly covered."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Triangles:
    """The surfaces of all parts at rest, in the root frame.

    Attributes:
        vertices: In metres.
        part: That each vertex belongs to.
        faces: Vertices, counter-clockwise seen from outside.
        edges: Pairs of vertices, each once.
        sides: The edge from each corner of a face to the next ...
        turns: ... and −1 where it runs the other way round, else 1.
    """

    vertices: Float[Tensor, "V 3"]
    part: Int[Tensor, " V"]
    faces: Int[Tensor, "F 3"]
    edges: Int[Tensor, "E 2"]
    sides: Int[Tensor, "F 3"]
    turns: Int[Tensor, "F 3"]

    @classmethod
    def from_mesh(
        cls,
        mesh: Mesh,
        device: torch.device | str | None = None,
        dtype: torch.dtype = torch.float32,
    ) -> "Triangles":
        """A category's mesh as tensors, with its edges."""
        faces = torch.as_tensor(mesh.faces, dtype=torch.long, device=device)
        ends = torch.stack([faces, faces.roll(-1, dims=1)], dim=-1)
        edges, sides = ends.sort(dim=-1).values.flatten(0, 1).unique(dim=0, return_inverse=True)
        return cls(
            vertices=torch.as_tensor(mesh.vertices, dtype=dtype, device=device),
            part=torch.as_tensor(mesh.part, dtype=torch.long, device=device),
            faces=faces,
            edges=edges,
            sides=sides.reshape(faces.shape),
            turns=(ends[..., 1] - ends[..., 0]).sign(),
        )


def stretched(mesh: Triangles, prior: Shape, shape: Shape) -> Float[Tensor, "*B V 3"]:
    """Where `shape.deform` moves the vertices of its prior."""
    scale = (shape.box_size / prior.box_size)[..., mesh.part, :]
    offset = mesh.vertices - prior.box_center[mesh.part]
    return shape.box_center[..., mesh.part, :] + scale * offset


def mesh_silhouettes(
    mesh: Triangles,
    vertices: Float[Tensor, "*#B V 3"],
    cam_T_part: Float[Tensor, "*#B P 4 4"],
    K: Float[Tensor, "*#B 3 3"],
    size: tuple[int, int],
    finer: int = FINER,
) -> Silhouettes:
    """Exact coverage of posed closed meshes, by part and of their union.

    Gradients of first order reach vertices, poses and cameras. A part that is not finite, or that
    comes nearer to the camera than `MIN_DEPTH`, is not drawn and has none.

    Args:
        mesh: What hangs together how.
        vertices: Its vertices (m), or those of an instance, see `stretched`.
        cam_T_part: Where the parts are.
        K: Intrinsics of the image to render.
        size: Height and width of that image.
        finer: Cells along a pixel's side.
    """
    num_parts = cam_T_part.shape[-3]
    batch = torch.broadcast_shapes(vertices.shape[:-2], cam_T_part.shape[:-3], K.shape[:-2])
    result = torch.promote_types(cam_T_part.dtype, torch.float32)
    whole = vertices.isfinite().all(-1, keepdim=True)
    pose = torch.where(cam_T_part.isfinite(), cam_T_part, 0.0).double()[..., mesh.part, :, :]
    at_rest = torch.where(whole, vertices, 0.0).double()
    x = (pose[..., :3, :3] * at_rest[..., None, :]).sum(-1) + pose[..., :3, 3]
    seen = torch.where(whole, x.detach(), torch.nan)
    x, seen = (t.expand(*batch, *t.shape[-2:]).reshape(-1, *t.shape[-2:]) for t in (x, seen))
    uv = project(x, K.double().expand(*batch, 3, 3).reshape(-1, 3, 3)) * finer
    seen = torch.where(uv.detach().isfinite().all(-1, keepdim=True), seen, torch.nan)
    way = _outlines(mesh, seen, num_parts)
    sample, edge = way.nonzero(as_tuple=True)
    ends = mesh.edges[edge]
    parts, union = _Coverage.apply(
        uv[sample[:, None], ends],
        way[sample, edge].double(),
        sample * num_parts + mesh.part[ends[:, 0]],
        _Cells(len(x), num_parts, *size, finer, result),
    )  # pyright: ignore[reportGeneralTypeIssues]
    shape = *batch, num_parts, *size
    return Silhouettes(parts=parts.reshape(shape), union=union.reshape(*batch, *size))


def _outlines(mesh: Triangles, x: Float[Tensor, "N V 3"], num_parts: int) -> Int[Tensor, "N E"]:
    """How many more seen faces lie to an edge's left than to its right; of nothing undrawable."""
    a, b, c = x[:, mesh.faces].unbind(-2)
    front = (torch.linalg.cross(b - a, c - a) * a).sum(-1) < 0
    turns = (front[..., None] * mesh.turns).flatten(1)
    way = turns.new_zeros(len(x), len(mesh.edges)).index_add(1, mesh.sides.flatten(), turns)
    bad = ~x.isfinite().all(-1) | ~(x[..., 2] > MIN_DEPTH)
    bad = way.new_zeros(len(x), num_parts).index_add(1, mesh.part, bad.to(way.dtype)) > 0
    return way.masked_fill(bad[:, mesh.part[mesh.edges[:, 0]]], 0)


class _Cells(NamedTuple):
    """The images: their number, parts, height and width (px), cells along a pixel's side, type."""

    samples: int
    parts: int
    height: int
    width: int
    finer: int
    dtype: torch.dtype

    @property
    def rows(self) -> int:
        """Of cells."""
        return self.height * self.finer

    @property
    def columns(self) -> int:
        """Of cells."""
        return self.width * self.finer

    def numbered(self, image: Tensor) -> tuple[Tensor, Tensor]:
        """The sample and the part of images that count the parts of all samples."""
        return image // self.parts, image % self.parts


class _Pieces(NamedTuple):
    """Straight edges, cut where they leave a cell of the image.

    Per piece: the edge it belongs to, where on it its middle is (0 to 1), how much of it it is, row
    and column of its cell, and the mean share of the cell's width to the right of it.
    """

    edge: Int[Tensor, " C"]
    middle: Float[Tensor, " C"]
    share: Float[Tensor, " C"]
    row: Int[Tensor, " C"]
    column: Int[Tensor, " C"]
    right: Float[Tensor, " C"]


class _Coverage(torch.autograd.Function):
    """From the ends of edges (cells) to covered shares of pixels, by part and of the union."""

    @staticmethod
    def forward(
        ctx: Any, ends: Tensor, way: Tensor, image: Tensor, cells: _Cells
    ) -> tuple[Tensor, Tensor]:
        begin, run = ends[:, 0], ends[:, 1] - ends[:, 0]
        pieces = _cut(begin, run, cells)
        areas = _areas(pieces, way * run[:, 1], image, cells)
        ctx.save_for_backward(*_sweeps(pieces, run, way, image, areas, cells))
        ctx.cells, ctx.edges = cells, len(ends)
        ctx.set_materialize_grads(False)
        layers = _layers(areas, cells)
        parts = _pooled(layers, cells.finer)
        if cells.parts == 1:
            return parts, parts[:, 0].clone()
        return parts, _pooled(layers.sum(1), cells.finer)

    @staticmethod
    @once_differentiable
    def backward(  # pyright: ignore[reportIncompatibleMethodOverride]
        ctx: Any, *grads: Tensor | None
    ) -> tuple[Tensor | None, ...]:
        edge, sweep, sample, part, pixel, part_open, union_open = ctx.saved_tensors
        by_part, by_union = grads
        by_cover = sweep.new_zeros(len(edge))
        if by_part is not None:
            by_cover += by_part.flatten(2)[sample, part, pixel] * part_open
        if by_union is not None:
            by_cover += by_union.flatten(1)[sample, pixel] * union_open
        by_ends = sweep.new_zeros(ctx.edges, 2, 2)
        return by_ends.index_add(0, edge, by_cover[:, None, None] * sweep), None, None, None


def _cut(begin: Tensor, run: Tensor, cells: _Cells) -> _Pieces:
    """Cut edges from (N, 2) ``begin`` to ``begin + run`` at the borders of the image's cells."""
    edge = torch.arange(len(begin), device=begin.device)
    size = cells.columns, cells.rows
    cuts = [edge.double()]
    for axis in (0, 1):
        low, high = (
            f(begin[:, axis], begin[:, axis] + run[:, axis]) for f in (torch.minimum, torch.maximum)
        )
        first = (low.floor() + 1).clamp(0, size[axis] + 1).long()
        last = high.floor().clamp(-1, size[axis]).long()
        count = (last - first + 1).clamp_min(0)
        which = edge.repeat_interleave(count)
        step = torch.arange(len(which), device=edge.device) - (count.cumsum(0) - count)[which]
        at = (first[which] + step - begin[which, axis]) / run[which, axis]
        cuts.append(which + at.clamp(0, 1 - 1e-12))
    at = torch.cat(cuts).sort().values
    which = at.long()
    at = at - which
    until = torch.ones_like(at)
    until[:-1] = torch.where(which[1:] == which[:-1], at[1:], 1.0)
    middle = (at + until) / 2
    place = begin[which] + middle[:, None] * run[which]
    corner = place.floor()
    column, row = (corner[:, axis].clamp(-1, size[axis]).long() for axis in (0, 1))
    return _Pieces(which, middle, until - at, row, column, 1 - (place - corner)[:, 0])


class _Areas(NamedTuple):
    """What pieces add to a cell and to all that follow in its row, in cells.

    Per addition: sample, part, row and column (one more than there are cells), and the area.
    """

    sample: Int[Tensor, " A"]
    part: Int[Tensor, " A"]
    row: Int[Tensor, " A"]
    column: Int[Tensor, " A"]
    area: Float[Tensor, " A"]


def _areas(pieces: _Pieces, fall: Tensor, image: Tensor, cells: _Cells) -> _Areas:
    """To the right of the pieces; ``fall``: how far each edge leads down."""
    inside = (pieces.row >= 0) & (pieces.row < cells.rows) & (pieces.column < cells.columns)
    edge, _, share, row, column, right = (t[inside] for t in pieces)
    right = torch.where(column < 0, 1.0, right)
    column = column.clamp_min(0)
    area = fall[edge] * share
    sample, part, row = (t.repeat(2) for t in (*cells.numbered(image[edge]), row))
    area = torch.cat([area * right, area * (1 - right)])
    return _Areas(sample, part, row, torch.cat([column, column + 1]), area)


def _layers(areas: _Areas, cells: _Cells) -> Float[Tensor, "N P H W"]:
    """How many layers of seen faces every cell has."""
    shape = cells.samples, cells.parts, cells.rows, cells.columns + 1
    index = (areas.sample * cells.parts + areas.part) * cells.rows + areas.row
    index = index * (cells.columns + 1) + areas.column
    total = areas.area.new_zeros(math.prod(shape), dtype=cells.dtype)
    total.index_add_(0, index, areas.area.to(cells.dtype))
    return total.reshape(shape)[..., :-1].cumsum_(-1)


def _layers_at(areas: _Areas, line: Tensor, at_line: Tensor, at: Tensor, cells: _Cells) -> Tensor:
    """`_layers` of some cells alone, in double precision: it must tell 1 from a little less.

    Args:
        areas: What adds up.
        line: The row of an image that each of them is in.
        at_line: The row of an image that each cell is in ...
        at: ... and its column.
        cells: The images.
    """
    wide = cells.columns + 1
    index, order = (line * wide + areas.column).sort()
    total = torch.cat([areas.area.new_zeros(1), areas.area[order].cumsum(0)])
    until = torch.searchsorted(index, at_line * wide + at, right=True)
    return total[until] - total[torch.searchsorted(index, at_line * wide)]


def _sweeps(
    pieces: _Pieces, run: Tensor, way: Tensor, image: Tensor, areas: _Areas, cells: _Cells
) -> tuple[Tensor, ...]:
    """Of the pieces in the image: what their pixel gains per cell that their edge's ends move.

    Their edge; the gain (C, 2, 2) for each end along x and y; sample, part and pixel; and whether
    the part's and the union's cell is not wholly covered: only then the pixel gains anything.
    """
    inside = (pieces.row >= 0) & (pieces.row < cells.rows)
    inside &= (pieces.column >= 0) & (pieces.column < cells.columns)
    edge, middle, share, row, column, _ = (t[inside] for t in pieces)
    across = torch.stack([-run[:, 1], run[:, 0]], dim=-1) * way[:, None] / cells.finer**2
    of_ends = torch.stack([1 - middle, middle], dim=-1) * share[:, None]
    sweep = of_ends[..., None] * across[edge][:, None, :]
    sample, part = cells.numbered(image[edge])
    pixel = row // cells.finer * cells.width + column // cells.finer

    def is_open(of_areas: Tensor, of_pieces: Tensor) -> Tensor:
        line, at_line = of_areas * cells.rows + areas.row, of_pieces * cells.rows + row
        return _layers_at(areas, line, at_line, column, cells) < FULL

    union_open = is_open(areas.sample, sample)
    part_open = union_open
    if cells.parts > 1:
        part_open = is_open(areas.sample * cells.parts + areas.part, image[edge])
    return edge, sweep, sample, part, pixel, part_open, union_open


def _pooled(layers: Tensor, finer: int) -> Tensor:
    """Mean over a pixel's cells of what is covered."""
    covered = layers.clamp_max(1.0)
    rows = covered[..., ::finer, :].clone()
    for k in range(1, finer):
        rows += covered[..., k::finer, :]
    pixels = rows[..., ::finer].clone()
    for k in range(1, finer):
        pixels += rows[..., k::finer]
    return pixels.div_(finer**2)
