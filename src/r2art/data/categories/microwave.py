"""Microwave ovens: plain, steel, black and retro ones. The example of docs/new_category.md."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from r2art.core.category import Joint
from r2art.data.procedural.assembly import assembled
from r2art.data.procedural.carved import carved
from r2art.data.procedural.controls import button, display, knob, print_keypad
from r2art.data.procedural.curved import revolved
from r2art.data.procedural.dishes import dish
from r2art.data.procedural.grips import grip
from r2art.data.procedural.materials import steel
from r2art.data.procedural.prints import Print, ink_on
from r2art.data.procedural.randomness import Color, between, chance, pick, spread, tinted, weighted
from r2art.data.procedural.solids import box, cylinder, decal, plate, xyz
from r2art.data.procedural.textures import label, speckled, sticker_image, word, worn
from r2art.data.shape import Instance, Material, Surface
from r2art.data.staging import Spread, Staging

STAGING = Staging(
    azimuth=float(np.radians(33)),
    azimuth_limit=float(np.radians(75)),
    elevation=(float(np.radians(19)), float(np.radians(11))),
    elevation_limits=(float(np.radians(3)), float(np.radians(60))),
    joints={"hinge": Spread(closed=0.22, opened=0.1, typical=0.5, beta=(3.0, 1.6))},
)
GAP = 0.0015  # m, between the door and what is around it
_WHITE, _BLACK, _STEEL = (0.92, 0.92, 0.91), (0.07, 0.07, 0.075), (0.66, 0.66, 0.67)
_RETRO: tuple[Color, ...] = (
    (0.93, 0.88, 0.74),  # cream
    (0.62, 0.82, 0.75),  # mint
    (0.7, 0.1, 0.1),
    (0.55, 0.72, 0.85),
    (0.9, 0.62, 0.65),
)
_HANDLES: dict[str, float] = {
    "bar": 4,
    "rod": 3,
    "bow": 3,
    "lip": 3,
    "recess": 3,
    "button": 6,
    "none": 1,
}
_CHROME = Material(color=(0.75, 0.75, 0.76), roughness=0.15, metallic=0.95)
_PLASTIC = Material(color=(0.08, 0.08, 0.08), roughness=0.7)
_HOLE = Material(color=(0.03, 0.03, 0.03), roughness=0.8)
_GLASS = Material(color=(0.03, 0.03, 0.035), roughness=0.06)


@dataclass(frozen=True)
class _Oven:
    """Measures (m) and looks; x = 0 is the middle, y = 0 the underside, z = 0 the door's back."""

    kind: str
    width: float
    height: float
    depth: float  # of the body behind the door
    door: float  # thickness
    panel: float  # width of the strip with the controls
    corner: float
    casing: Material
    front: Material
    trim: Material
    handle: str

    @property
    def split(self) -> float:
        """The x at which the door ends and the controls begin."""
        return self.width / 2 - self.panel

    def front_box(self, left: float, right: float) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner of what stands in front, flush with the door, between two x."""
        inset = 0.3 * self.corner  # stays within the casing's round outline
        low, high = max(left, inset - self.width / 2), min(right, self.width / 2 - inset)
        return xyz(low, inset, GAP), xyz(high, self.height - inset, self.door)

    def cavity(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner of the cooking space."""
        side = 0.028 + 0.3 * self.corner
        low = xyz(side - self.width / 2, 0.03, 0.05 - self.depth)
        return low, xyz(self.split - 0.014, self.height - 0.028, 0.0)


def generate(rng: np.random.Generator, photos: Sequence[Path] = ()) -> Instance:
    """A microwave oven: ``body`` and ``door``, which is shut at rest and opens to the left."""
    del photos  # nothing on it shows one
    shape_rng, body_rng, door_rng = rng.spawn(3)
    oven = _sample(shape_rng)
    hinge = Joint(
        name="hinge",
        kind="revolute",
        parent=0,
        axis=(0.0, -1.0, 0.0),
        pivot=(-oven.width / 2 + 0.3 * oven.corner, oven.height / 2, GAP),
        limits=(0.0, float(np.radians(np.clip(shape_rng.normal(105, 12), 88, 135)))),
    )
    body = [
        *_casing(body_rng, oven),
        *_controls(body_rng, oven),
        *_cooking_space(body_rng, oven),
        *_vents_and_feet(body_rng, oven),
    ]
    return assembled("microwave", {"body": body, "door": _door(door_rng, oven)}, [hinge])


def _sample(rng: np.random.Generator) -> _Oven:
    kind = weighted(rng, {"white": 3.2, "black": 2.2, "steel": 3.6, "silver": 1.2, "retro": 1.6})
    color = {
        "white": tinted(rng, _WHITE, 0.012),
        "black": tinted(rng, _BLACK, 0.015),
        "steel": pick(rng, (_BLACK, (0.35, 0.35, 0.36), _STEEL, _STEEL)),
        "silver": tinted(rng, (0.62, 0.63, 0.64), 0.03),
        "retro": tinted(rng, pick(rng, _RETRO), 0.03),
    }[kind]
    grain = speckled(rng, between(rng, 0.02, 0.06))
    if chance(rng, 0.3):
        grain = worn(rng, grain, between(rng, 0.3, 0.9))
    casing = Material(color=color, texture=grain, roughness=between(rng, 0.25, 0.6))
    front = steel(rng) if kind == "steel" else casing
    plain = Material(color=ink_on(color), roughness=0.4)
    width = spread(rng, 0.485, 0.055, 0.44, 0.55)
    return _Oven(
        kind=kind,
        width=width,
        height=float(np.clip(width * between(rng, 0.54, 0.64), 0.245, 0.325)),
        depth=float(np.clip(width * between(rng, 0.66, 0.84), 0.3, 0.42)),
        door=between(rng, 0.026, 0.042),
        panel=width * between(rng, 0.19, 0.28),
        corner=between(rng, 0.018, 0.035) if kind == "retro" else pick(rng, (0.003, 0.006, 0.012)),
        casing=casing,
        front=_GLASS if kind in ("black", "steel", "silver") and chance(rng, 0.22) else front,
        trim=_CHROME if kind == "retro" else pick(rng, (_CHROME, plain, front, _GLASS)),
        handle=weighted(rng, _HANDLES),
    )


def _casing(rng: np.random.Generator, oven: _Oven) -> list[Surface]:
    """The outer shell with the cooking space in it; its light may be on."""
    tone = weighted(rng, {(0.78, 0.78, 0.76): 3, (0.6, 0.6, 0.61): 2, (0.16, 0.16, 0.17): 1})
    light = between(rng, 0.25, 0.7) if chance(rng, 0.45) else 0.06
    walls = Material(
        color=tinted(rng, tone, 0.03), roughness=between(rng, 0.3, 0.6), emission=light
    )
    rim = Material(color=pick(rng, (walls.color, _BLACK, _STEEL)), roughness=0.4)
    half = oven.width / 2
    return [
        *carved(
            (xyz(-half, 0, -oven.depth), xyz(half, oven.height, 0)),
            oven.cavity(),
            2,
            oven.casing,
            inside=walls,
            rim=rim,
            radius=oven.corner,
            inner_radius=between(rng, 0.004, 0.02),
            tile=0.4,
        )
    ]


def _controls(rng: np.random.Generator, oven: _Oven) -> list[Surface]:
    """The strip at the right: a print with a display, keys, knobs or buttons."""
    low, high = oven.front_box(oven.split + GAP / 2, oven.width / 2)
    base = oven.front if chance(rng, 0.65) else _GLASS
    sheet = Print(high[0] - low[0], high[1] - low[1], base.color)
    wide, face = sheet.width, xyz(low[0], low[1], high[2])
    part = pick(rng, (base, oven.trim, Material(color=sheet.ink, roughness=0.4)))
    pieces, bottom, top = [], 0.018, sheet.height - 0.035
    if oven.handle == "button":
        pieces += button(face + xyz(wide / 2, 0.036, 0), (0.72 * wide, 0.034), 0.004, part)
        bottom += 0.05
    sheet.text((wide / 2, sheet.height - 0.016), min(0.011, 0.12 * wide), word(rng))
    knobs = 2 if oven.kind == "retro" and chance(rng, 0.6) else pick(rng, (0, 0, 1, 2))
    if knobs < 2:
        tall = between(rng, 0.02, 0.032)
        middle = face + xyz(wide / 2, top - tall / 2, 0)
        pieces.append(display(rng, middle, (0.74 * wide, tall)))
        top -= tall + 0.012
    room = (top - bottom) / 2
    for k in range(knobs):
        y, radius = bottom + (k + 0.5) * room, min(0.2 * wide, 0.24 * room) * between(rng, 0.85, 1)
        scale = (("0", "5", "10", "15", "20", "30", ""), ("", "1", "2", "3", "4", "5"))[k]
        sheet.dial((wide / 2, y), 1.15 * radius, scale, 0.006)
        pieces += knob(rng, face + xyz(wide / 2, y, 0), radius, between(rng, 0.012, 0.022), part)
    if knobs < 2:
        pieces += _keys(rng, sheet, face, (bottom + knobs * room, top), part)
    look = replace(base, color=(1, 1, 1), texture=sheet.texture())
    pieces += plate(low, high, 2, oven.front, radius=0.003, bevel=(0, 0.0015), top=look)
    return pieces


def _keys(
    rng: np.random.Generator,
    sheet: Print,
    face: np.ndarray,
    heights: tuple[float, float],
    look: Material,
) -> list[Surface]:
    """Keys printed on the sheet, or buttons on the face, between two heights."""
    (bottom, top), wide = heights, sheet.width
    if top - bottom > 0.1 and chance(rng, 0.6):
        split = bottom + 0.62 * (top - bottom)
        print_keypad(sheet, (0.1 * wide, bottom), (0.9 * wide, split), "123456789*0#", 3)
        for k in range(4):
            at = wide * (0.3 + 0.4 * (k % 2)), split + (0.25 + 0.5 * (k // 2)) * (top - split)
            sheet.box(at, (0.34 * wide, 0.36 * (top - split)), 0.002)
            sheet.symbol(rng, at, 0.24 * (top - split))
        return []
    pieces, count = [], int(rng.integers(2, 6))
    columns, solid, step = pick(rng, (1, 2)), chance(rng, 0.7), (top - bottom) / count
    tall = min(0.02, 0.45 * step)
    for k in range(count * columns):
        x, y = wide * (k % columns + 1) / (columns + 1), top - (k // columns + 0.5) * step
        if solid:
            pieces += button(face + xyz(x, y, 0), (0.5 * wide / columns, tall), 0.0025, look)
        sheet.symbol(rng, (x, y + (0.85 * tall if solid else 0)), 0.5 * tall)
    return pieces


def _cooking_space(rng: np.random.Generator, oven: _Oven) -> list[Surface]:
    """Turntable, lamp and the cover of the wave guide; sometimes a plate or a cup."""
    low, high = oven.cavity()
    x, _, z = (low + high) / 2
    radius = min(0.46 * min(high[0] - low[0], high[2] - low[2]), 0.16)
    mica = Material(color=tinted(rng, (0.62, 0.58, 0.5), 0.03), roughness=0.6)
    lamp = Material(color=(1.0, 0.93, 0.75), emission=between(rng, 0.2, 1.5))
    wall = xyz(high[0], low[1], low[2]), high
    pieces = [
        decal(*wall, "left", mica, at=(0.5, 0.5), size=(0.11, 0.07)),
        decal(*wall, "left", lamp, at=(0.75, 0.75), size=(0.035, 0.035)),
    ]
    floor = xyz(x, low[1], z)
    if chance(rng, 0.85):  # the others have a flat floor
        glass = Material(color=tinted(rng, (0.6, 0.66, 0.66), 0.04), roughness=0.1)
        pieces += cylinder(floor + xyz(0, 0.006, 0), 1, 0.022, 0.012, _PLASTIC)
        floor = floor + xyz(0, 0.01, 0)
        pieces.append(revolved(dish("plate", radius, 0.014), floor, 1, glass, segments=28))
    if chance(rng, 0.35):
        china = Material(color=tinted(rng, pick(rng, (_WHITE, *_RETRO)), 0.04), roughness=0.15)
        plates = dish("plate", between(rng, 0.5, 0.85) * radius, 0.022)
        profile = pick(rng, (plates, dish("cup", 0.041, 0.09), dish("bowl", 0.075, 0.06)))
        pieces.append(revolved(profile, floor, 1, china, segments=24))
    return pieces


def _vents_and_feet(rng: np.random.Generator, oven: _Oven) -> list[Surface]:
    """Slots at the sides and behind, a label behind, feet below."""
    low, high = xyz(-oven.width / 2, 0, -oven.depth), xyz(oven.width / 2, oven.height, 0)
    pieces: list[Surface] = []
    start, up = between(rng, 0.08, 0.3), pick(rng, (0.2, 0.75))
    for side, count in (("left", 10), ("right", 12), ("back", 24)):
        for k in range(count):
            at = (start + k * 0.014 / (oven.width if side == "back" else oven.depth), up)
            pieces.append(decal(low, high, side, _HOLE, at=at, size=(0.005, 0.045)))
    paper = Material(color=(1, 1, 1), texture=label(rng), roughness=0.7)
    pieces.append(decal(low, high, "back", paper, at=(0.3, 0.45), size=(0.09, 0.045)))
    tall, x, z = between(rng, 0.006, 0.016), oven.width / 2 - 0.04, oven.depth - 0.05
    for place in ((x, -0.04), (-x, -0.04), (x, -z), (-x, -z)):
        foot = xyz(place[0], -tall / 2, place[1])
        pieces += cylinder(foot, 1, 0.014, tall, _PLASTIC, segments=12)
    return pieces


def _door(rng: np.random.Generator, oven: _Oven) -> list[Surface]:
    """The door with its window, handle, and the inside that shields."""
    low, high = oven.front_box(-oven.width / 2, oven.split - GAP / 2)
    size = high - low
    glazed = oven.front is _GLASS or chance(rng, 0.2)
    look = _GLASS if glazed else oven.front
    pieces = [*plate(low, high, 2, oven.front, radius=0.003, bevel=(0, 0.003), top=look, tile=0.4)]
    grip = 0.05 if oven.handle in ("bar", "rod", "bow", "recess") else 0.018
    margin = xyz(between(rng, 0.03, 0.05), between(rng, 0.032, 0.055), 0)
    pane = low + margin, high - margin - xyz(grip, 0, 0)
    pane[0][2] = high[2]
    pieces += _window(rng, oven, *pane, flush=glazed)
    if chance(rng, 0.6):
        badge = replace(look, color=(1, 1, 1), texture=sticker_image(rng, look.color))
        at = (0.5 * (pane[0] + pane[1]) - low)[0] / size[0], pick(rng, (0.06, 0.94))
        pieces.append(decal(low, high, "front", badge, at=at, size=(0.056, 0.014)))
    return [*pieces, *_handle(rng, oven, high), *_door_inside(rng, oven, low, high)]


def _mesh(rng: np.random.Generator) -> Material:
    """A pane before the perforated shield; the turntable shows through, or the light behind."""
    y, x = np.mgrid[0:160, 0:256]
    holes = (x % 5 < 2) & ((y + 2 * (x // 5 % 2)) % 5 < 2)
    plate_in = ((x - 128) / between(rng, 70, 100)) ** 2 + ((y - 118) / 16) ** 2 < 1
    tone, lit = between(rng, 0.03, 0.12) + between(rng, 0.0, 0.06) * plate_in, chance(rng, 0.12)
    if lit:
        tone = tone + between(rng, 0.2, 0.5) * np.exp(
            -(((x - 150) / 90) ** 2) - ((y - 60) / 70) ** 2
        )
    value = tone * (1 + between(rng, 0.3, 1.2) * holes)
    tint = (1.0, 0.9, 0.68) if lit else (1.0, 1.0, 1.05)
    image = (255 * (value[..., None] * tint).clip(0, 1)).astype(np.uint8)
    return Material(color=(1, 1, 1), texture=image, roughness=0.07, emission=0.35 * lit)


def _window(
    rng: np.random.Generator, oven: _Oven, low: np.ndarray, high: np.ndarray, *, flush: bool
) -> list[Surface]:
    """A pane in a frame that stands out of the door by the frame's depth, or is glued on it."""
    frame = 0.002 if flush else between(rng, 0.004, 0.014)
    depth = 0.0008 if flush else between(rng, 0.002, 0.005)
    wide = xyz(frame, frame, 0)
    edge = pick(rng, (oven.trim, _GLASS, oven.front)) if not flush else _GLASS
    return [
        *carved(
            (low - wide - xyz(0, 0, 0.001), high + wide + xyz(0, 0, depth)),
            (low + xyz(0, 0, 2e-4), high + xyz(0, 0, depth)),
            2,
            edge,
            inside=_HOLE,
            floor=_mesh(rng),
            radius=frame + (radius := pick(rng, (0.003, 0.008, 0.02, 0.035))),
            inner_radius=radius,
        )
    ]


def _handle(rng: np.random.Generator, oven: _Oven, corner: np.ndarray) -> list[Surface]:
    """A handle beside the free edge of the door, whose upper outer corner is ``corner``."""
    edge = corner - xyz(0, oven.height / 2 - 0.3 * oven.corner, 0)
    half = oven.height * between(rng, 0.26, 0.4)
    if oven.handle in ("bar", "rod", "bow"):
        at, reach = edge - xyz(between(rng, 0.02, 0.032), 0, 0), between(rng, 0.026, 0.042)
        return grip(rng, at, 1, 2 * half, reach, oven.trim, oven.handle)
    if oven.handle == "lip":
        ends = edge - xyz(0.016, half, 0.001), edge + xyz(0, half, 0.014)
        return [*plate(*ends, 2, oven.trim, radius=0.004, bevel=(0, 0.003))]
    if oven.handle == "recess":
        ends = edge - xyz(0.034, half, 0.001), edge + xyz(-0.004, half, 0.0015)
        frame = plate(*ends, 2, oven.trim, radius=0.006)
        return [*frame, decal(*ends, "front", _HOLE, at=(0.55, 0.5), size=(0.02, 1.9 * half))]
    return []


def _door_inside(
    rng: np.random.Generator, oven: _Oven, low: np.ndarray, high: np.ndarray
) -> list[Surface]:
    """The shield that closes the cooking space, seen when the door is open, and the latches."""
    opening = oven.cavity()
    tone = weighted(rng, {(0.85, 0.85, 0.84): 2, (0.5, 0.5, 0.51): 2, (0.1, 0.1, 0.1): 3})
    lining = Material(color=tinted(rng, tone, 0.03), roughness=0.45)
    ends = opening[0] + xyz(0.004, 0.004, 0), opening[1] - xyz(0.004, 0.004, 0)
    ends[0][2], ends[1][2] = -0.005, GAP + 1e-4
    size = ends[1] - ends[0]
    pieces = [
        decal(low, high, "back", lining),
        *plate(*ends, 2, lining, radius=0.008, bevel=(0.003, 0)),
        decal(
            *ends, "back", replace(_mesh(rng), emission=0.0), size=(size[0] - 0.05, size[1] - 0.05)
        ),
    ]
    for y in (0.25, 0.75):
        hook = xyz(high[0] - 0.007, low[1] + y * (high[1] - low[1]), GAP)
        pieces.append(box(hook - xyz(0.002, 0.006, 0.012), hook + xyz(0.002, 0.006, 0), _PLASTIC))
    return pieces
