"""Colours and textures of a compiled MuJoCo model."""

# pyright: reportAttributeAccessIssue=false
# mujoco's names come from a compiled module that type checkers cannot see into.

import mujoco
import numpy as np
from numpy.typing import NDArray

from r2art.data.models import primitives
from r2art.data.models.textures import from_pixels
from r2art.data.shape import Material

FloatArray = NDArray[np.floating]

_UNSET = np.array([0.5, 0.5, 0.5, 1.0], dtype=np.float32)  # colour of a geom that has none
_RGB = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)


class Looks:
    """Materials of a model's geoms; each texture is decoded once."""

    def __init__(self, m: mujoco.MjModel) -> None:
        self.m = m
        self._textures: dict[int, NDArray[np.uint8]] = {}

    def rgba(self, geom: int) -> FloatArray:
        """(4,) colour: the geom's own if it has one, else its material's."""
        own, material = self.m.geom_rgba[geom], int(self.m.geom_matid[geom])
        return own if material < 0 or (own != _UNSET).any() else self.m.mat_rgba[material]

    def alpha(self, geom: int) -> float:
        """Opacity."""
        return float(self.rgba(geom)[3])

    def material(self, geom: int) -> Material:
        """How the geom looks."""
        r, g, b = (float(np.clip(c, 0, 1)) for c in self.rgba(geom)[:3])
        material, texture = int(self.m.geom_matid[geom]), self._texture_of(geom)
        if material < 0:
            return Material(color=(r, g, b))
        roughness, metallic = self.m.mat_roughness[material], self.m.mat_metallic[material]
        shiny = float(self.m.mat_shininess[material])
        return Material(
            color=(r, g, b),
            roughness=float(roughness) if roughness >= 0 else 1.0 - 0.8 * min(max(shiny, 0.0), 1.0),
            metallic=max(float(metallic), 0.0),
            texture=None if texture < 0 else self._pixels(texture),
        )

    def mapped(self, geom: int, corners: FloatArray, uv: FloatArray | None) -> FloatArray:
        """(F, 3, 2) texture coordinates; where a mesh has none, from the sides of its box."""
        material = int(self.m.geom_matid[geom])
        across, up = self.m.mat_texrepeat[material].tolist()
        if uv is None or not self._is_flat(self._texture_of(geom)):
            metric = bool(self.m.mat_texuniform[material])
            return primitives.box_mapped(corners, (across, up), metric)
        return np.stack([uv[..., 0] * across, 1.0 - uv[..., 1] * up], axis=-1)

    def _texture_of(self, geom: int) -> int:
        material = int(self.m.geom_matid[geom])
        return -1 if material < 0 else int(self.m.mat_texid[material].reshape(-1)[_RGB])

    def _is_flat(self, texture: int) -> bool:
        return int(self.m.tex_type[texture]) == int(mujoco.mjtTexture.mjTEXTURE_2D)

    def _pixels(self, texture: int) -> NDArray[np.uint8]:
        """A picture; of a cube's six, stacked, the first."""
        if texture not in self._textures:
            m, start = self.m, int(self.m.tex_adr[texture])
            height, width = int(m.tex_height[texture]), int(m.tex_width[texture])
            channels = int(m.tex_nchannel[texture])
            if not self._is_flat(texture):
                height = min(height, width)
            pixels = m.tex_data[start : start + height * width * channels]
            self._textures[texture] = from_pixels(pixels.reshape(height, width, channels))
        return self._textures[texture]
