"""What lies on a cutter's handle: rubber, ribs, names, screws, a cap and a clip."""

import numpy as np

from r2art.data.categories.cutter.handle import BOTTOM, COLUMNS, LEFT, TILE, TOP, Shell
from r2art.data.categories.cutter.style import CutterStyle
from r2art.data.procedural.brands import brand
from r2art.data.procedural.profiles import rounded, stations
from r2art.data.procedural.randomness import between, chance, pick
from r2art.data.procedural.sheets import draped, sampled, sheet
from r2art.data.procedural.solids import cylinder, decal, xyz
from r2art.data.shape import Material, Surface

FloatArray = np.ndarray
_SEAM = Material(color=(0.05, 0.05, 0.05), roughness=0.8)


def details(rng: np.random.Generator, style: CutterStyle, shell: Shell) -> list[Surface]:
    """All of them that this one has."""
    pieces: list[Surface] = []
    end = style.length / 2
    capped = style.kind in ("slim", "snap") and chance(rng, 0.5)
    if capped:
        pieces += _cap(rng, style, shell)
    elif style.kind == "metal":
        pieces += _seam(style, shell)
    if style.kind == "grip" or (style.kind == "snap" and chance(rng, 0.5)):
        pieces += _rubber(rng, style, shell)
    elif chance(rng, 0.65):
        pieces += _ribs(rng, style, shell, pick(rng, (-0.55 * end, 0.25 * end, 0.55 * end)))
    if style.kind in ("metal", "grip") and chance(rng, 0.8):
        pieces += _screw(rng, style, shell, between(rng, 0.1, 0.3) * end)
    clipped = style.kind == "slim" and chance(rng, 0.4)
    if clipped:
        pieces += _clip(style, shell)
    if chance(rng, 0.8):
        middle = between(rng, -0.4, -0.2) * end
        pieces += _name(rng, style, shell, middle, twice=not clipped and chance(rng, 0.5))
    return pieces


def _panel(
    shell: Shell, span: tuple[float, float], columns: tuple[float, float], count: int
) -> FloatArray:
    """Points of the shell over a span along z and over its columns, its ends rounded."""
    z = stations(*span, 0.006, (0.006, 0.006))
    narrowed = 1 - 0.6 * rounded(z, *span, (0.006, 0.006)) / 0.006
    rows = np.array([shell.row(place) for place in z])
    middle, half = (columns[0] + columns[1]) / 2, (columns[1] - columns[0]) / 2
    across = middle + half * np.linspace(-1, 1, count) * narrowed[:, None]
    return sampled(shell.grid, rows[:, None], across)


def _cap(rng: np.random.Generator, style: CutterStyle, shell: Shell) -> list[Surface]:
    """The rear end in another colour; many snap blades off."""
    long = min(between(rng, 0.008, 0.016), style.slot_span[0] + style.length / 2 - 0.002)
    rows = np.linspace(0, shell.row(-style.length / 2 + long), 8)
    grid = sampled(shell.grid, rows[:, None], np.arange(COLUMNS))
    look = pick(rng, (style.accent, style.accent, style.button))
    outer = grid * (1 + 0.0005 / np.abs(grid).max(axis=(0, 1)) * (1, 1, 0))
    outer[0, :, 2] -= 4e-4
    inner = outer.copy()
    inner[0] = inner[0].mean(axis=0)
    inner[1:] = grid[1:] * (0.97, 0.97, 1)
    return [*sheet(outer, inner, look, wrap=True, tile=TILE)]


def _seam(style: CutterStyle, shell: Shell) -> list[Surface]:
    """Where the two halves of a cast handle meet."""
    rows = np.arange(1, len(shell.z) - 1)[:, None]
    left = sampled(shell.grid, rows, [LEFT + 0.42, LEFT + 0.58])
    return [draped(left, _SEAM, lift=1.5e-4)]


def _rubber(rng: np.random.Generator, style: CutterStyle, shell: Shell) -> list[Surface]:
    """A soft panel around the side where the fingers lie, or on both faces."""
    end = style.length / 2
    span = (-end + between(rng, 0.012, 0.035), style.nose - between(rng, 0.012, 0.045))
    look = style.rubber
    if chance(rng, 0.6):
        edge = between(rng, 0.6, 2.0)
        ring = (TOP + 1 + edge, BOTTOM - edge)
        return [draped(_panel(shell, span, ring, 15), look, lift=4e-4)]
    pieces = []
    for first in (TOP + 1, LEFT + 1):
        columns = (first + 0.5, first + 3.6) if first == TOP + 1 else (first + 0.9, first + 4.5)
        pieces.append(draped(_panel(shell, span, columns, 7), look, lift=4e-4))
    return pieces


def _ribs(
    rng: np.random.Generator, style: CutterStyle, shell: Shell, place: float
) -> list[Surface]:
    """Raised bars across both faces."""
    count, pitch = int(rng.integers(4, 11)), between(rng, 0.0025, 0.004)
    wide = 0.55 * pitch
    look = pick(rng, (style.body, style.rubber, style.accent))
    pieces: list[Surface] = []
    for k in range(count):
        low = place + (k - count / 2) * pitch
        if low + wide > style.nose - 0.004 or low < 0.005 - style.length / 2:
            continue
        for columns in ((TOP + 1.25, TOP + 3.5), (BOTTOM - 2.5, BOTTOM - 0.25)):
            rows = np.array([[shell.row(low)], [shell.row(low + wide)]])
            base = sampled(shell.grid, rows, np.linspace(*columns, 4))
            out = base + xyz(0, np.sign(base[..., 1].mean()) * 5e-4, 0)
            pieces += sheet(out, base, look)
    return pieces


def _screw(rng: np.random.Generator, style: CutterStyle, shell: Shell, z: float) -> list[Surface]:
    radius = between(rng, 0.0025, 0.004)
    pieces: list[Surface] = []
    for column, side in ((TOP + 0.5, 1), (BOTTOM + 0.5, -1)):
        at = sampled(shell.grid, shell.row(z), column)
        pieces += cylinder(at, 1, radius, 0.0009, style.steel, bevel=2e-4)
        reach = xyz(radius, 0.00045, 0.0004)
        slot = ("top" if side > 0 else "bottom", _SEAM)
        pieces.append(decal(at - reach, at + reach, *slot, size=(1.6 * radius, 0.0008), lift=1e-4))
    return pieces


def _name(
    rng: np.random.Generator, style: CutterStyle, shell: Shell, middle: float, *, twice: bool
) -> list[Surface]:
    """The maker's name along the handle, on the upper face or, ``twice``, on both."""
    look, aspect = brand(rng, style.body)
    pieces = []
    sides = [(TOP + 1.15, TOP + 2.0)] if style.slot == "face" else [(TOP - 0.6, TOP + 1.6)]
    if twice:
        sides.append((BOTTOM - 0.6, BOTTOM + 1.6))
    for first, last in sides:
        a, b = sampled(shell.grid, shell.row(middle), [first, last])
        tall = 0.85 * float(np.linalg.norm(b - a))
        long = min(tall * aspect, 0.36 * style.length)
        spread = 0.075 * (last - first)
        rows = np.linspace(shell.row(middle - long / 2), shell.row(middle + long / 2), 9)
        columns = np.linspace(first + spread, last - spread, 5)[:, None]
        grid = sampled(shell.grid, rows, columns)  # right along +z, up from first to last
        pieces.append(draped(grid[::-1] if chance(rng, 0.5) else grid[:, ::-1], look))
    return pieces


def _clip(style: CutterStyle, shell: Shell) -> list[Surface]:
    """A steel clip for the pocket on the lower face."""
    end = style.length / 2
    z = np.array([0.0, 0.004, 0.03, 0.034]) + 0.002 - end
    floor = -shell.top(-end, end)
    y = floor + np.array([0.0006, -0.0011, -0.0008, -0.0002])
    x = np.array([-0.0022, 0.0022])  # seen from below, its right is at x < 0
    outer = np.stack(np.broadcast_arrays(x, y[:, None], z[:, None]), axis=-1)
    return [*sheet(outer, outer + xyz(0, 0.0004, 0), style.steel)]
