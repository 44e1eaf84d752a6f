"""Light around a scene: measured probes or soft skies with windows, and lamps."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from r2art.core.errors import InputError
from r2art.data.rendering.render import Light, diffuse_environment
from r2art.data.scenes.surroundings import random_color
from r2art.data.staging import about

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Sky:
    """Radiance around the scene.

    Attributes:
        radiance: (h, w, 3), see `r2art.data.rendering.render.Scene.environment`.
        diffuse: Its `diffuse_environment`.
        sky_R_world: (3, 3) how it is turned about the vertical.
        is_backdrop: Whether it may be seen behind everything.
    """

    radiance: FloatArray
    diffuse: FloatArray
    sky_R_world: FloatArray
    is_backdrop: bool


@lru_cache(maxsize=32)
def read_probe(path: Path) -> tuple[FloatArray, FloatArray]:
    """A Radiance ``.hdr`` light probe as (H, W, 3) float32, mean 1, and its diffuse light."""
    data = path.read_bytes()
    header, _, rest = data.partition(b"\n\n")
    size, _, body = rest.partition(b"\n")
    words = size.split()
    if b"32-bit_rle_rgbe" not in header or len(words) != 4 or words[0] != b"-Y":
        raise InputError(f"{path} is not a -Y +X Radiance RGBE file; convert it to .hdr")
    height, width = int(words[1]), int(words[3])
    rgbe = _decode_rgbe(np.frombuffer(body, np.uint8), height, width).astype(np.float32)
    radiance = rgbe[..., :3] * np.exp2(rgbe[..., 3:] - 136.0)
    # A sun of a few pixels would only make fireflies; the scene's own lights cast the shadows.
    radiance = np.minimum(radiance, 20 * np.median(radiance) + 1e-6)
    radiance = np.ascontiguousarray(radiance / radiance.mean(), np.float32)
    return radiance, diffuse_environment(radiance)


def _decode_rgbe(data: NDArray[np.uint8], height: int, width: int) -> NDArray[np.uint8]:
    """New-style run-length decoding: per scan line, four planes of runs and literals."""
    out = np.empty((height, 4, width), np.uint8)
    i = 0
    for row in out:
        i += 4
        for plane in row:
            x = 0
            while x < width:
                n = int(data[i])
                if n > 128:
                    plane[x : x + n - 128] = data[i + 1]
                    i, x = i + 2, x + n - 128
                else:
                    plane[x : x + n] = data[i + 1 : i + 1 + n]
                    i, x = i + 1 + n, x + n
    return out.transpose(0, 2, 1)


def some_sky(rng: np.random.Generator, probes: tuple[Path, ...]) -> Sky:
    """A probe, turned at random, or a soft sky with windows and soft boxes."""
    if probes and rng.random() < 0.4:
        radiance, diffuse = read_probe(probes[rng.integers(len(probes))])
        turn = about(1, rng.uniform(-np.pi, np.pi))
        return Sky(radiance=radiance, diffuse=diffuse, sky_R_world=turn, is_backdrop=True)
    height = 32
    stops = random_color(rng, 3) * np.array([[1.6], [1.0], [0.5]]) * rng.uniform(0.6, 1.4)
    up = np.linspace(1, -1, height)
    sky = np.stack([np.interp(up, (-1, 0, 1), stops[::-1, c]) for c in range(3)], axis=-1)
    sky = np.repeat(sky[:, None], 2 * height, axis=1).astype(np.float32)
    for _ in range(rng.integers(0, 4)):  # windows and soft boxes, to be mirrored
        y, x = rng.integers(0, height // 2), rng.integers(0, 2 * height)
        h, w = rng.integers(2, 8, 2)
        sky[y : y + h, x : x + w] += rng.uniform(1, 4)
    return Sky(
        radiance=sky,
        diffuse=diffuse_environment(sky),
        sky_R_world=np.eye(3),
        is_backdrop=False,
    )


def lights(rng: np.random.Generator, cam_R_world: FloatArray) -> tuple[Light, ...]:
    """One or two lamps above the object, directions in the camera frame."""
    out = []
    for strength in (rng.uniform(0.5, 4), rng.uniform(0.2, 1.5))[: rng.integers(1, 3)]:
        azimuth, height = rng.uniform(-np.pi, np.pi), rng.uniform(0.2, 1.45)
        world = np.array(
            [np.cos(height) * np.sin(azimuth), np.sin(height), np.cos(height) * np.cos(azimuth)]
        )
        tint = 1 + rng.uniform(-0.15, 0.15) * np.array([1, 0, -1])
        out.append(
            Light(
                direction=tuple(cam_R_world @ world),
                color=tuple(strength * tint),
                radius=float(rng.uniform(0.01, 0.15)),
            )
        )
    return tuple(out)
