"""Section 4.2: the category's prior and its deformation to the instance in the photo.

The paper deforms a prior without saying how. Here every part has a scale along each axis and
a shift of its centre; the joint that moves a part goes along. Zero coefficients give the prior.
Letters: B batch, P parts, J joints, M points per part. Metres; all at rest, in the root frame.
"""

from dataclasses import dataclass, replace

import torch
from jaxtyping import Float
from torch import Tensor

from r2art.core.category import Category, Symmetry
from r2art.method.kinematics import KinematicModel


@dataclass(frozen=True, kw_only=True)
class Shape:
    """An articulated object at rest.

    Attributes:
        box_center: Centre of each part's box.
        box_size: Full extents of each part's box.
        points: Points on the surface of each part.
        normals: Unit outward normals there.
        areas: Surface (m²) that each *point* stands for.
        kinematics: The joints.
    """

    box_center: Float[Tensor, "*B P 3"]
    box_size: Float[Tensor, "*B P 3"]
    points: Float[Tensor, "*B P M 3"]
    normals: Float[Tensor, "*B P M 3"]
    areas: Float[Tensor, "*B P M"]
    kinematics: KinematicModel


@dataclass(frozen=True, kw_only=True)
class Prior(Shape):
    """The mean object of a category, without batch dimensions.

    Attributes:
        frontal_area: ``S_wld`` of Eq. 1 (m²).
        symmetry: Of the category.
        keypoints: Of the category; None where it has none.
    """

    frontal_area: float
    symmetry: Symmetry | None = None
    keypoints: Float[Tensor, "P N 3"] | None = None

    @classmethod
    def from_category(
        cls,
        category: Category,
        device: torch.device | str | None = None,
        dtype: torch.dtype = torch.float32,
    ) -> "Prior":
        """A category's arrays as tensors; a part's area is shared equally by its points."""
        points = torch.as_tensor(category.points, dtype=dtype, device=device)
        part_areas = torch.as_tensor(category.areas, dtype=dtype, device=device)
        num_points = points.shape[-2]
        return cls(
            box_center=torch.as_tensor(category.box_center, dtype=dtype, device=device),
            box_size=torch.as_tensor(category.box_size, dtype=dtype, device=device),
            points=points,
            normals=torch.as_tensor(category.normals, dtype=dtype, device=device),
            areas=(part_areas / num_points)[:, None].expand(-1, num_points),
            kinematics=KinematicModel.from_category(category, device, dtype),
            frontal_area=category.frontal_area,
            symmetry=category.symmetry,
            keypoints=None
            if category.keypoints is None
            else torch.as_tensor(category.keypoints, dtype=dtype, device=device),
        )

    def to(self, device: torch.device | str) -> "Prior":
        """The same prior on another device."""
        moved = {k: v.to(device) for k, v in vars(self).items() if isinstance(v, Tensor)}
        return replace(self, **moved, kinematics=self.kinematics.to(device))


@dataclass(frozen=True, kw_only=True)
class Deformation:
    """How an instance differs from its prior.

    Attributes:
        log_scale: Logarithm of each part's scale along x, y, z.
        center_shift: How far (m) each part's centre is from where the root's scale puts it;
            zero for the root.
    """

    log_scale: Float[Tensor, "*B P 3"]
    center_shift: Float[Tensor, "*B P 3"]


def deform(prior: Shape, deformation: Deformation) -> Shape:
    """The instance that the coefficients describe.

    With ``s_k = exp(log_scale_k)``: a part's size is scaled by ``s_k``, its centre moves to
    ``c_k = s_0 c0_k + shift_k``, and its points and its joint's pivot go to
    ``c_k + s_k (x − c0_k)``. Normals scale by the inverse; a surface element of normal n grows
    by ``|det S| |S⁻ᵀ n|``. Joint axes, kinds and limits stay.
    """
    scale = deformation.log_scale.exp()
    center = scale[..., :1, :] * prior.box_center + deformation.center_shift
    point_scale = scale[..., None, :]
    normals = prior.normals / point_scale
    stretch = torch.linalg.vector_norm(normals, dim=-1, keepdim=True)
    kinematics = prior.kinematics
    from_center = kinematics.pivot - prior.box_center[..., 1:, :]
    pivot = center[..., 1:, :] + scale[..., 1:, :] * from_center
    return Shape(
        box_center=center,
        box_size=scale * prior.box_size,
        points=center[..., None, :] + point_scale * (prior.points - prior.box_center[..., None, :]),
        normals=normals / stretch,
        areas=scale.prod(-1, keepdim=True) * stretch[..., 0] * prior.areas,
        kinematics=replace(kinematics, axis=kinematics.axis.expand(pivot.shape), pivot=pivot),
    )


def thinned(shape: Shape, every: int) -> Shape:
    """The shape with only each ``every``-th point, which stands for the area of those left out."""
    keep = slice(None, None, every)
    areas = shape.areas[..., keep]
    return replace(
        shape,
        points=shape.points[..., keep, :],
        normals=shape.normals[..., keep, :],
        areas=areas * (shape.areas.shape[-1] / areas.shape[-1]),
    )


def deformation_of(
    prior: Shape, box_center: Float[Tensor, "*B P 3"], box_size: Float[Tensor, "*B P 3"]
) -> Deformation:
    """The coefficients with which `deform` gives exactly these part boxes."""
    log_scale = (box_size / prior.box_size).log()
    scaled_center = log_scale[..., :1, :].exp() * prior.box_center
    return Deformation(log_scale=log_scale, center_shift=box_center - scaled_center)


def box_corners(
    box_center: Float[Tensor, "*B P 3"], box_size: Float[Tensor, "*B P 3"]
) -> Float[Tensor, "*B P 8 3"]:
    """The eight corners of each part's box; x changes slowest, z fastest."""
    half = torch.arange(2, dtype=box_size.dtype, device=box_size.device) - 0.5
    return box_center[..., None, :] + box_size[..., None, :] * torch.cartesian_prod(
        half, half, half
    )
