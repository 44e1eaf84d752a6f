"""What stands around an object: light, background photos, a table or floor, walls, clutter.

Everything works without any file; a folder of photos (``.jpg``, ``.png``), light probes
(``.hdr``) and textures (pictures in a folder whose name contains "texture") adds variety.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

from r2art.core.errors import InputError
from r2art.data.render import GAMMA, Light
from r2art.data.shape import Material, Surface

FloatArray = NDArray[np.floating]
PICTURES = {".jpg", ".jpeg", ".png"}


@dataclass(frozen=True)
class Surroundings:
    """Files to draw backgrounds, light and textures from; all may be empty."""

    photos: tuple[Path, ...] = field(default=(), repr=False)
    probes: tuple[Path, ...] = field(default=(), repr=False)
    textures: tuple[Path, ...] = field(default=(), repr=False)

    @classmethod
    @lru_cache(maxsize=4)
    def from_folder(cls, folder: Path | None) -> "Surroundings":
        """Sort a folder's files (recursively) by what they are good for."""
        if folder is None:
            return cls()
        if not folder.is_dir():
            raise InputError(f"backgrounds folder {folder} does not exist; give a folder of photos")
        files = sorted(p for p in folder.rglob("*") if p.is_file())
        probes = tuple(p for p in files if p.suffix.lower() == ".hdr")
        pictures = [p for p in files if p.suffix.lower() in PICTURES]
        textures = tuple(p for p in pictures if "texture" in p.parent.name)
        photos = tuple(p for p in pictures if "texture" not in p.parent.name)
        return cls(photos, probes, textures)


@lru_cache(maxsize=512)
def read_picture(path: Path, longest: int = 512) -> NDArray[np.uint8]:
    """A photo as (H, W, 3) uint8, at most ``longest`` px on its longer side."""
    try:
        with Image.open(path) as image:
            rgb = image.convert("RGB")
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise InputError(f"cannot read the background {path}: {error}; remove it") from error
    rgb.thumbnail((longest, longest))
    return np.asarray(rgb)


@lru_cache(maxsize=32)
def read_probe(path: Path) -> FloatArray:
    """A Radiance ``.hdr`` light probe as (H, W, 3) float32, mean radiance 1."""
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
    return radiance / radiance.mean()


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


def noise_picture(rng: np.random.Generator, size: int = 128) -> NDArray[np.uint8]:
    """(size, size, 3) smooth random pattern between two or three random colours."""
    value = np.zeros((size, size))
    stretch = rng.integers(1, 5) if rng.random() < 0.4 else 1
    for octave in range(rng.integers(2, 6)):
        cells = 2 ** (octave + 1)
        grid = rng.random((cells, max(1, cells // stretch))).astype(np.float32)
        layer = Image.fromarray(grid).resize((size, size), Image.Resampling.BICUBIC)
        value += np.asarray(layer) / 1.7**octave
    value = (value - value.min()) / np.ptp(value)
    stops = random_color(rng, 3)
    mixed = np.stack([np.interp(value, (0, 0.5, 1), stops[:, c]) for c in range(3)], axis=-1)
    return (255 * mixed).astype(np.uint8)


def random_color(rng: np.random.Generator, n: int = 1) -> FloatArray:
    """(n, 3) sRGB colours, mostly muted."""
    grey = rng.uniform(0.05, 1, (n, 1))
    vivid = rng.random((n, 3))
    amount = rng.beta(1.2, 3, (n, 1))
    return np.clip(grey * (1 - amount) + vivid * amount, 0, 1)


def picture_or_noise(rng: np.random.Generator, files: tuple[Path, ...]) -> NDArray[np.uint8]:
    """One of the files, or a noise picture where there are none."""
    if files:
        return read_picture(files[rng.integers(len(files))])
    return noise_picture(rng)


def environment(rng: np.random.Generator, probes: tuple[Path, ...]) -> tuple[FloatArray, bool]:
    """Radiance around the scene, (h, w, 3), and whether it may serve as a backdrop."""
    if probes and rng.random() < 0.4:
        probe = read_probe(probes[rng.integers(len(probes))])
        return np.roll(probe, rng.integers(probe.shape[1]), axis=1), True
    height = 32
    stops = random_color(rng, 3) * np.array([[1.6], [1.0], [0.5]]) * rng.uniform(0.6, 1.4)
    up = np.linspace(1, -1, height)
    sky = np.stack([np.interp(up, (-1, 0, 1), stops[::-1, c]) for c in range(3)], axis=-1)
    sky = np.repeat(sky[:, None], 2 * height, axis=1)
    for _ in range(rng.integers(0, 4)):  # windows and soft boxes, to be mirrored
        y, x = rng.integers(0, height // 2), rng.integers(0, 2 * height)
        h, w = rng.integers(2, 8, 2)
        sky[y : y + h, x : x + w] += rng.uniform(1, 4)
    return sky.astype(np.float32), False


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


def backdrop(
    rng: np.random.Generator, photos: tuple[Path, ...], height: int, width: int
) -> NDArray[np.uint8]:
    """(height, width, 3) picture behind everything: a photo crop, a plain shade, or noise."""
    kind = rng.random()
    if kind < 0.35:
        return plain_backdrop(rng, height, width)
    photo = picture_or_noise(rng, photos if kind < 0.9 else ())
    h, w = photo.shape[:2]
    side = rng.uniform(0.4, 1) * min(h, w)
    x, y = rng.uniform(0, w - side), rng.uniform(0, h - side)
    image = Image.fromarray(photo).resize(
        (width, height), Image.Resampling.BILINEAR, box=(x, y, x + side, y + side)
    )
    if rng.random() < 0.5:
        image = image.transpose(Image.Transpose.FLIP_LEFT_RIGHT)
    return np.asarray(image)


def plain_backdrop(rng: np.random.Generator, height: int, width: int) -> NDArray[np.uint8]:
    """White, another plain colour, or a soft gradient, as in product photos."""
    first = np.ones(3) * rng.uniform(0.9, 1) if rng.random() < 0.5 else random_color(rng)[0]
    second = first if rng.random() < 0.5 else np.clip(first + rng.normal(0, 0.15, 3), 0, 1)
    angle = rng.uniform(0, 2 * np.pi)
    y, x = np.mgrid[0 : 1 : height * 1j, 0 : 1 : width * 1j]
    ramp = x * np.cos(angle) + y * np.sin(angle)
    ramp = ((ramp - ramp.min()) / np.ptp(ramp))[..., None]
    return (255 * (first * (1 - ramp) + second * ramp)).astype(np.uint8)


def _material(rng: np.random.Generator, files: Surroundings) -> Material:
    kind = rng.random()
    texture = None
    if kind < 0.45:
        texture = picture_or_noise(rng, files.textures)
    elif kind < 0.6:
        texture = picture_or_noise(rng, files.photos)
    elif kind < 0.75:
        texture = noise_picture(rng)
    tint = random_color(rng)[0] if texture is None else rng.uniform(0.6, 1) * np.ones(3)
    return Material(color=tuple(tint), roughness=float(rng.uniform(0.25, 1)), texture=texture)


def _quad(corners: FloatArray, material: Material, repeat: float) -> Surface:
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * repeat
    return Surface(
        vertices=corners,
        faces=np.array([[0, 1, 2], [0, 2, 3]]),
        normals=np.tile(normal / np.linalg.norm(normal), (4, 1)),
        uv=uv,
        material=material,
    )


def ground(
    rng: np.random.Generator, lower: FloatArray, upper: FloatArray, files: Surroundings
) -> list[Surface]:
    """A table or floor under the box (``lower``, ``upper``), sometimes with a wall behind it."""
    center = (lower + upper) / 2
    size = float(np.linalg.norm(upper - lower))
    reach = size * (rng.uniform(0.6, 1.5, 4) if rng.random() < 0.5 else rng.uniform(3, 12, 4))
    left, right = center[0] - reach[0], center[0] + reach[1]
    back, front = center[2] - reach[2], center[2] + reach[3]
    wall = rng.random() < 0.3
    if wall:
        back = min(back, lower[2] - 0.02)
        back = lower[2] - rng.uniform(0.02, 0.6) if rng.random() < 0.7 else back
    y = lower[1] - 1e-4
    repeat = float(rng.uniform(1, 4)) * reach.mean() / (2 * size) + 0.3
    corners = np.array([[left, y, front], [right, y, front], [right, y, back], [left, y, back]])
    surfaces = [_quad(corners, _material(rng, files), repeat)]
    if wall:
        top = y + 4 * size
        corners = np.array(
            [[left, y, back], [right, y, back], [right, top, back], [left, top, back]]
        )
        surfaces.append(_quad(corners, _material(rng, files), repeat))
    return surfaces


def thing(
    rng: np.random.Generator, center: FloatArray, size: float, files: Surroundings
) -> Surface:
    """A box, can, ball or slab of about ``size`` (m), turned at random about the vertical."""
    shape = rng.integers(4)
    extents = size * rng.uniform(0.4, 1, 3)
    if shape == 0:
        mesh = trimesh.creation.box(extents)
    elif shape == 1:
        mesh = trimesh.creation.cylinder(extents[0] / 2, extents[1], sections=24)
    elif shape == 2:
        mesh = trimesh.creation.icosphere(2, size / 2)
    else:
        mesh = trimesh.creation.box(extents * np.array([1, 0.15, 1]))
    angle = rng.uniform(0, 2 * np.pi)
    turn = trimesh.transformations.rotation_matrix(angle, [0, 1, 0])
    if rng.random() < 0.4:
        turn = turn @ trimesh.transformations.random_rotation_matrix(rng.random(3))
    mesh.apply_transform(turn)
    corners = mesh.triangles.reshape(-1, 3)
    smooth = shape == 2
    normals = mesh.vertex_normals[mesh.faces.ravel()] if smooth else mesh.face_normals.repeat(3, 0)
    return Surface(
        vertices=corners + center,
        faces=np.arange(len(corners)).reshape(-1, 3),
        normals=np.array(normals),
        uv=(corners[:, :2] + corners[:, 1:]) / size,
        material=_material(rng, files),
    )


def clutter(
    rng: np.random.Generator, lower: FloatArray, upper: FloatArray, files: Surroundings
) -> list[Surface]:
    """Up to four things standing round the box, in the object's frame."""
    size = float(np.linalg.norm(upper - lower))
    out = []
    for _ in range(rng.integers(0, 5)):
        extent = size * rng.uniform(0.1, 0.45)
        angle = rng.uniform(0, 2 * np.pi)
        far = size * rng.uniform(0.55, 1.2) + extent / 2
        place = (lower + upper) / 2 + far * np.array([np.sin(angle), 0, np.cos(angle)])
        place[1] = lower[1] + extent * 0.4
        out.append(thing(rng, place, extent, files))
    return out


def linear(picture: NDArray[np.uint8]) -> FloatArray:
    """sRGB bytes to linear radiance in [0, 1]."""
    return (picture / 255.0) ** GAMMA
