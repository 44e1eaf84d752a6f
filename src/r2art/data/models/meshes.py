"""Mesh files (OBJ, STL, DAE, GLB, PLY, ...) to triangles with colours and textures."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.visual.color import ColorVisuals
from trimesh.visual.material import PBRMaterial, SimpleMaterial

from r2art.core.errors import InputError
from r2art.data.models.model import MeshFile, Patch, triple
from r2art.data.models.textures import as_texture
from r2art.data.shape import Material

FloatArray = NDArray[np.floating]
Color = tuple[float, float, float]

LARGEST = 20.0
"""Metres across beyond which a mesh is taken to be in millimetres."""
PAINTED = (".dae", ".glb", ".gltf")
"""Formats whose own colours are meant; an OBJ or STL rather takes the colour its model gives."""


def read_mesh(mesh: MeshFile, who: str) -> tuple[Patch, ...]:
    """The triangles of a mesh file, one patch for each material.

    Args:
        mesh: The file.
        who: Whose it is, for messages.

    Raises:
        InputError: It cannot be read, is empty, not finite, or so large that it must be in
            millimetres.
    """
    path, patches = mesh.path, []
    scale = np.array(mesh.scale) * _unit(path)
    for part in _load(path, who):
        corners = np.asarray(part.vertices, dtype=np.float64)[np.asarray(part.faces)] * scale
        uv = _uv(part)
        if np.prod(scale) < 0:
            corners, uv = corners[:, ::-1], uv[:, ::-1]
        patches.append(Patch(corners=corners, uv=uv, material=_material(part, mesh)))
    corners = np.concatenate([patch.corners for patch in patches] or [np.zeros((0, 3, 3))])
    if not len(corners):
        raise InputError(f"{path} ({who}) holds no triangles; export it as a triangle mesh")
    if not np.isfinite(corners).all():
        raise InputError(f"{path} ({who}) holds numbers that are not finite; export it again")
    extent = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    if extent > LARGEST:
        raise InputError(
            f"{path} ({who}) is {extent:.0f} m across; if it is in millimetres, give the mesh "
            'scale="0.001 0.001 0.001" in the model'
        )
    return tuple(patches)


def _load(path: Path, who: str) -> list[trimesh.Trimesh]:
    try:
        scene = trimesh.load_scene(path, process=False)
        parts = scene.dump() if hasattr(scene, "dump") else []
    except ModuleNotFoundError:
        raise
    except Exception as error:  # trimesh and its readers raise whatever they meet
        raise InputError(
            f"{path} ({who}) is not a mesh that can be read ({_short(error)}); export it again"
        ) from None
    return [part for part in parts if isinstance(part, trimesh.Trimesh) and len(part.faces)]


def _unit(path: Path) -> float:
    """Metres in a file's unit, which only COLLADA tells."""
    if path.suffix.lower() != ".dae":
        return 1.0
    found = re.search(rb"<unit[^>]*\smeter=\"([-+.eE\d]+)\"", path.read_bytes())
    return float(found[1]) if found else 1.0


def _short(error: Exception) -> str:
    return (str(error).splitlines() or [""])[0][:120] or type(error).__name__


def _uv(part: trimesh.Trimesh) -> FloatArray:
    uv = getattr(part.visual, "uv", None)
    if uv is None or len(uv) != len(part.vertices) or not np.isfinite(uv).all():
        return np.zeros((len(part.faces), 3, 2))
    return np.asarray(uv, dtype=np.float64)[np.asarray(part.faces)]


def _material(part: trimesh.Trimesh, mesh: MeshFile) -> Material:
    """The mesh's own look where it is meant, else the model's colour."""
    suffix, look = mesh.path.suffix.lower(), part.visual
    if isinstance(look, ColorVisuals):
        painted = look.kind is not None
        return _plain(mesh.color or (_color(look.main_color) if painted else None))
    own: Any = getattr(look, "material", None)
    if type(own) is SimpleMaterial:
        factor, picture = own.diffuse, own.image
    elif type(own) is PBRMaterial:
        factor, picture = own.baseColorFactor, own.baseColorTexture
    else:
        return _plain(mesh.color)
    if picture is None and mesh.color is not None and suffix not in PAINTED:
        return _plain(mesh.color)
    color = _color(factor)
    if picture is not None and max(color) < 0.01:  # exporters write black where a picture is
        color = (1.0, 1.0, 1.0)
    texture = None if picture is None else as_texture(picture)
    if suffix not in (".glb", ".gltf"):  # the others tell no more than a colour
        return Material(color=color, texture=texture)
    rough, metal = getattr(own, "roughnessFactor", None), getattr(own, "metallicFactor", None)
    return Material(
        color=color, roughness=_factor(rough, 0.5), metallic=_factor(metal, 0.0), texture=texture
    )


def _plain(color: Color | None) -> Material:
    return Material(color=color) if color else Material()


def _color(factor: Any) -> Color:
    """sRGB in [0, 1] of trimesh's 8-bit colour; white where there is none."""
    if factor is None:
        return 1.0, 1.0, 1.0
    values = np.asarray(factor)
    scale = 255.0 if values.dtype.kind in "ui" else 1.0
    return triple(np.clip(values[:3] / scale, 0, 1))


def _factor(value: Any, default: float) -> float:
    return default if value is None else float(np.clip(value, 0, 1))
