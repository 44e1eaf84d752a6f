"""What a stapler is like before it is built: its kind and its measures."""

from dataclasses import dataclass

import numpy as np

from r2art.data.categories.stapler.looks import looks
from r2art.data.procedural.randomness import between, chance, pick, spread, weighted
from r2art.data.shape import Material

# Rear, middle, front of the cover's height above the magazine, relative to its greatest.
_CROWNS: dict[tuple[float, ...], float] = {
    (0.75, 1.0, 0.95, 0.8): 3,
    (0.6, 0.75, 0.95, 1.0): 2,
    (0.8, 1.0, 0.8, 0.55): 2,
    (1.0, 0.75, 0.75, 1.0): 1.5,
    (1.0, 0.9, 0.7, 0.6): 1,
    (0.9, 0.95, 1.0, 0.95): 1,
}


@dataclass(frozen=True)
class StaplerStyle:
    """Measures (m) and looks of one stapler, the arm pressed down on its base.

    Attributes:
        kind: ``classic``, ``modern``, ``vintage``, ``mini``, ``heavy`` or ``long``.
        length: Of the base.
        base_half: Half its width at the rear, at the waist and at the front.
        corner: Radius of its rear and its front corners.
        base_height: Of its upper side, where the anvil lies.
        waist: How much lower it is in the middle.
        edge: Radius of its upper edges.
        folded: Whether it is folded from sheet metal, not moulded.
        pad: Thickness of the rubber below it.
        inset: Distance of the hinge from its rear end.
        magazine: Half the width, and the height of the magazine.
        reach: Length of the magazine's cover; the rest of a long arm is a bare beam.
        gap: Between magazine and anvil at the mouth when the stapler stands on a desk.
        lift: How much further the cover's front stands off the magazine.
        cover_half: Half the cover's width at the rear, in the middle and at the front.
        wall: Thickness of the cover.
        crown: Greatest height of the cover above the magazine.
        crown_shape: Its course from the rear to the front.
        nose: Length of the cover's rounded front, and how far it falls, as a share.
        skirt: How far the cover reaches down the magazine, rear and front, as shares.
        overhang: How far the cover stands out before the magazine.
        opening: How far the arm would open (rad), were the base's rear not in the way.
        ears_outside: Whether the hinge's ears enclose the cover, not only the magazine.
    """

    kind: str
    length: float
    base_half: tuple[float, float, float]
    corner: tuple[float, float]
    base_height: float
    waist: float
    edge: float
    folded: bool
    pad: float
    inset: float
    magazine: tuple[float, float]
    reach: float
    gap: float
    lift: float
    cover_half: tuple[float, float, float]
    wall: float
    crown: float
    crown_shape: tuple[float, ...]
    nose: tuple[float, float]
    skirt: tuple[float, float]
    overhang: float
    opening: float
    ears_outside: bool
    base: Material
    cover: Material
    steel: Material
    pad_look: Material
    accent: Material

    @property
    def floor(self) -> float:
        """Height of the pressed magazine's underside."""
        return self.base_height + 0.0016

    @property
    def hinge(self) -> tuple[float, float]:
        """Height and place along z of the hinge line."""
        return self.floor + 0.55 * self.magazine[1], -self.length / 2 + self.inset

    @property
    def mouth(self) -> float:
        """Place along z of the magazine's front."""
        return self.length / 2 - 0.06 * min(self.length, 0.15)

    @property
    def tail(self) -> float:
        """How far the arm reaches behind its hinge."""
        room = self.hinge[0] - self.base_height - 0.0012
        return min(room, 0.8 * self.inset)

    @property
    def heel(self) -> float:
        """How far the magazine reaches behind the hinge, so that its corner clears the base."""
        drop = self.hinge[0] - self.floor
        return float(np.sqrt((drop + 0.0009) ** 2 - drop**2))


def sample_style(rng: np.random.Generator) -> StaplerStyle:
    """Draw a stapler of one of the kinds that are sold."""
    kind = weighted(
        rng, {"classic": 5, "modern": 3, "vintage": 2.2, "mini": 1.6, "heavy": 0.9, "long": 0.6}
    )
    length = {
        "classic": spread(rng, 0.132, 0.12, 0.098, 0.17),
        "modern": spread(rng, 0.148, 0.12, 0.11, 0.19),
        "vintage": spread(rng, 0.148, 0.17, 0.1, 0.21),
        "mini": spread(rng, 0.064, 0.12, 0.052, 0.09),
        "heavy": spread(rng, 0.25, 0.1, 0.2, 0.3),
        "long": spread(rng, 0.285, 0.06, 0.25, 0.3),
    }[kind]
    magazine = _magazine(rng, kind)
    wall = between(rng, 0.0007, 0.0011) if kind == "vintage" else between(rng, 0.0012, 0.0022)
    opening = _opening(rng, kind)
    folds = opening > 2.0
    cover_half = _cover_half(rng, kind, magazine[0], wall)
    ears_outside = kind != "modern" and chance(rng, 0.55)
    base_half = _base_half(rng, kind, max(cover_half) if ears_outside else magazine[0] + 0.004)
    return StaplerStyle(
        kind=kind,
        length=length,
        base_half=base_half,
        corner=(
            base_half[0] * between(rng, 0.25, 0.7),
            base_half[2] * pick(rng, (0.3, 0.45, 0.7, 0.95)),
        ),
        base_height=_base_height(rng, kind),
        waist=between(rng, 0.0, 0.3),
        edge=between(rng, 0.0008, 0.004),
        folded=kind == "vintage" or (kind in ("classic", "heavy", "long") and chance(rng, 0.45)),
        pad=between(rng, 0.0012, 0.003),
        inset=between(rng, *((0.045, 0.06) if folds else (0.07, 0.13))) * min(length, 0.16) + 0.002,
        magazine=magazine,
        reach=min(length, between(rng, 0.1, 0.15)) if kind == "long" else length,
        gap=_gap(rng, kind),
        lift=_lift(rng, kind),
        cover_half=cover_half,
        wall=wall,
        crown=_crown(rng, kind),
        crown_shape=(0.15, *_crown_shape(rng, kind)[1:]) if folds else _crown_shape(rng, kind),
        nose=_nose(rng, kind),
        skirt=_skirt(rng, kind),
        overhang=between(rng, 0.0, 0.005) * (3 if kind == "heavy" else 1),
        opening=opening,
        ears_outside=ears_outside,
        **looks(rng, kind),
    )


def _opening(rng: np.random.Generator, kind: str) -> float:
    if kind in ("heavy", "long"):
        return float(np.radians(between(rng, 25, 70)))
    low, high = weighted(rng, {(25, 50): 3, (50, 92): 4, (150, 170): 2.5})
    return float(np.radians(between(rng, low, high)))


def _magazine(rng: np.random.Generator, kind: str) -> tuple[float, float]:
    """Half the width over the staples' crown, and height."""
    if kind == "mini" and chance(rng, 0.6):
        return 0.0053, between(rng, 0.007, 0.009)  # No. 10
    if kind == "heavy":
        return between(rng, 0.0068, 0.0078), between(rng, 0.017, 0.023)
    return between(rng, 0.0066, 0.0072), between(rng, 0.0095, 0.0135)  # 24/6 and 26/6


def _cover_half(
    rng: np.random.Generator, kind: str, magazine: float, wall: float
) -> tuple[float, float, float]:
    least = magazine + wall + 0.0005
    extra = {
        "classic": (0.0015, 0.005),
        "modern": (0.004, 0.009),
        "vintage": (0.0, 0.002),
        "mini": (0.001, 0.0045),
        "heavy": (0.003, 0.007),
        "long": (0.001, 0.003),
    }[kind]
    middle = least + between(rng, *extra)
    if kind == "vintage" or chance(rng, 0.35):
        return middle, middle, middle
    rear = least + max(0.0012, (middle - least) * between(rng, 0.6, 1.3))
    return rear, middle, least + (middle - least) * between(rng, 0.5, 1.3)


def _base_half(rng: np.random.Generator, kind: str, least: float) -> tuple[float, float, float]:
    low, high = {
        "classic": (0.015, 0.021),
        "modern": (0.018, 0.026),
        "vintage": (0.014, 0.023),
        "mini": (0.0095, 0.0145),
        "heavy": (0.025, 0.045),
        "long": (0.02, 0.032),
    }[kind]
    front = max(between(rng, low, high), least)
    rear = max(front * between(rng, 0.75, 1.1), least + 0.0035)
    waist = min(front, rear) * (between(rng, 0.68, 0.95) if chance(rng, 0.6) else 1.0)
    return rear, max(waist, 0.6 * least), front


def _base_height(rng: np.random.Generator, kind: str) -> float:
    low, high = {
        "classic": (0.007, 0.013),
        "modern": (0.009, 0.017),
        "vintage": (0.005, 0.011),
        "mini": (0.005, 0.009),
        "heavy": (0.008, 0.02),
        "long": (0.007, 0.014),
    }[kind]
    return between(rng, low, high)


def _gap(rng: np.random.Generator, kind: str) -> float:
    scale = {"mini": 0.6, "heavy": 1.6, "long": 1.4}.get(kind, 1.0)
    return scale * between(rng, 0.003, 0.013)


def _lift(rng: np.random.Generator, kind: str) -> float:
    low, high = {
        "classic": (0.0, 0.012),
        "modern": (0.004, 0.022),
        "vintage": (0.003, 0.014),
        "mini": (0.0, 0.005),
        "heavy": (0.015, 0.045),
        "long": (0.004, 0.015),
    }[kind]
    return between(rng, low, high)


def _crown(rng: np.random.Generator, kind: str) -> float:
    low, high = {
        "classic": (0.006, 0.014),
        "modern": (0.01, 0.02),
        "vintage": (0.003, 0.007),
        "mini": (0.005, 0.012),
        "heavy": (0.009, 0.018),
        "long": (0.006, 0.012),
    }[kind]
    return between(rng, low, high)


def _crown_shape(rng: np.random.Generator, kind: str) -> tuple[float, ...]:
    if kind == "vintage":
        return pick(rng, ((1.0, 1.0, 1.0, 1.0), (1.0, 0.8, 0.9, 2.2), (0.8, 1.0, 1.0, 0.9)))
    return weighted(rng, _CROWNS)


def _nose(rng: np.random.Generator, kind: str) -> tuple[float, float]:
    if kind == "vintage":
        return between(rng, 0.003, 0.008), between(rng, 0.2, 0.9)
    scale = {"mini": 0.7, "modern": 1.6, "heavy": 1.6}.get(kind, 1.0)
    return scale * between(rng, 0.005, 0.018), between(rng, 0.45, 1.0)


def _skirt(rng: np.random.Generator, kind: str) -> tuple[float, float]:
    if kind in ("vintage", "heavy"):
        return between(rng, 0.25, 0.6), between(rng, 0.1, 0.5)
    rear = between(rng, 0.45, 0.85)
    return rear, rear * between(rng, 0.3, 1.0)
