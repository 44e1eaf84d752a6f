"""A category's prior as a few kilobytes of text, for the metadata of a model file."""

from base64 import b64decode, b64encode
from dataclasses import replace
from io import BytesIO

import numpy as np
from numpy.typing import DTypeLike

from r2art.core.category import Category
from r2art.core.mesh import Mesh

POINTS = 512
"""Per part, at most."""


def to_text(category: Category, points: int = POINTS) -> str:
    """The prior with at most ``points`` points per part, in half precision."""
    keep = slice(None, None, -(-category.points.shape[1] // points))
    thin = replace(
        category,
        mesh=category.mesh and _converted(category.mesh, np.float16, np.uint16),
        points=category.points[:, keep].astype(np.float16),
        normals=category.normals[:, keep].astype(np.float16),
    )
    file = BytesIO()
    thin.save(file)
    return b64encode(file.getvalue()).decode("ascii")


def from_text(text: str) -> Category:
    """The inverse of `to_text`, but for the points left out and the precision."""
    category = Category.load(BytesIO(b64decode(text)))
    return replace(
        category,
        mesh=category.mesh and _converted(category.mesh, np.float32, np.int64),
        points=category.points.astype(np.float32),
        normals=category.normals.astype(np.float32),
    )


def _converted(mesh: Mesh, real: DTypeLike, whole: DTypeLike) -> Mesh:
    return Mesh(
        vertices=mesh.vertices.astype(real),
        faces=mesh.faces.astype(whole),
        part=mesh.part.astype(whole),
    )
