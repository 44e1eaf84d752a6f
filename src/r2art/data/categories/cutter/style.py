"""What a cutter is like before it is built: its kind and its measures.

Seen from +y the handle lies flat, its nose at +z, the cutting edge on the left (x < 0).
"""

from dataclasses import dataclass

import numpy as np

from r2art.data.categories.cutter.looks import looks
from r2art.data.procedural.randomness import between, chance, pick, spread, weighted
from r2art.data.shape import Material

Knots = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class CutterStyle:
    """Measures (m) and looks of one cutter, its blade drawn in.

    Attributes:
        kind: ``slim`` and ``snap`` have snap-off blades; ``metal`` and ``grip`` a trapezoid.
        length: Of the handle with its nose.
        blade: Width and thickness of the blade.
        trapezoid: Whether it is a trapezoid, not one that snaps off.
        slot: ``back``: the slider runs along the narrow side; ``face``: along the upper face.
        slot_span: Where the slot begins and ends along z.
        slot_half: Half the slot's width.
        cavity: Half the height of the channel in which the blade runs.
        back: Distance of the narrow side at x > 0 from the middle of the blade.
        shoulder: How far it stands beyond the blade at the nose.
        belly: The same of the other side, along z (knots).
        thick: Half the handle's thickness along z (knots).
        round: Radii of the cross section's edges, across and upright, as shares of the most.
        ends: Lengths of the rounded rear end and nose.
        slant: Slope of the nose's end, which is furthest on the cutting edge's side.
        rail: How far a steel channel stands out of the nose; 0: there is none.
        slider: Length and height of the thumb slider, and its form.
        travel: How far the blade slides out.
    """

    kind: str
    length: float
    blade: tuple[float, float]
    trapezoid: bool
    slot: str
    slot_span: tuple[float, float]
    slot_half: float
    cavity: float
    back: float
    shoulder: float
    belly: Knots
    thick: Knots
    round: tuple[float, float]
    ends: tuple[float, float]
    slant: float
    rail: float
    slider: tuple[float, float, str]
    travel: float
    body: Material
    rubber: Material
    steel: Material
    accent: Material
    button: Material

    @property
    def nose(self) -> float:
        """Place along z where the handle ends and the rail, if any, stands out."""
        return self.length / 2 - self.rail

    @property
    def lateral(self) -> float:
        """Place across of the slot's middle on the upper face."""
        return 0.12 * self.blade[0]


def sample_style(rng: np.random.Generator) -> CutterStyle:
    """Draw one of the knives that are sold."""
    kind = weighted(rng, {"slim": 3.2, "snap": 3.6, "metal": 2.2, "grip": 1.6})
    trapezoid = kind == "metal" or (kind == "grip" and chance(rng, 0.6))
    wide = _blade_width(rng, kind, trapezoid)
    length = {
        "slim": spread(rng, 0.135, 0.06, 0.115, 0.155),
        "snap": spread(rng, 0.158, 0.06, 0.135, 0.182),
        "metal": spread(rng, 0.148, 0.07, 0.125, 0.175),
        "grip": spread(rng, 0.166, 0.06, 0.145, 0.19),
    }[kind]
    rail = 0.0
    if not trapezoid and chance(rng, 0.75):
        rail = between(rng, 0.3, 0.9) * (0.009 if kind == "slim" else 0.018)
    slot = "face" if not trapezoid and chance(rng, 0.4) else "back"
    cavity = between(rng, 0.0011, 0.0015)
    button = _slider(rng, kind, slot)
    nose = length / 2 - rail
    if trapezoid:
        travel = between(rng, 0.022, 0.032)
        last = nose - between(rng, 0.03, 0.042)
        span = (last - travel - button[0], last)
    else:
        behind = between(rng, 0.014, 0.03) if kind == "slim" else between(rng, 0.018, 0.045)
        span = (behind - length / 2, nose - between(rng, 0.006, 0.018))
        travel = float(np.clip(span[1] - span[0] - button[0], 0.02, 0.108))
    thick = _thickness(rng, kind, length, cavity)
    least, most = {"slim": (0.0018, 0.0045), "metal": (0.003, 0.0095)}.get(kind, (0.002, 0.006))
    beyond = between(rng, least, most)
    return CutterStyle(
        kind=kind,
        length=length,
        blade=(wide, 0.00065 if trapezoid else between(rng, 0.00038, 0.0006)),
        trapezoid=trapezoid,
        slot=slot,
        slot_span=span,
        slot_half=cavity if slot == "back" else between(rng, 0.0014, 0.0028),
        cavity=cavity,
        back=wide / 2 + beyond,
        shoulder=beyond if kind == "slim" else beyond * between(rng, 0.1, 1.0),
        belly=_belly(rng, kind, length, wide),
        thick=thick,
        round=_roundness(rng, kind),
        ends=_ends(rng, kind),
        slant=between(rng, 0.1, 0.4) if kind != "slim" and chance(rng, 0.5) else 0.0,
        rail=rail,
        slider=button,
        travel=travel,
        **looks(rng, kind),
    )


def _blade_width(rng: np.random.Generator, kind: str, trapezoid: bool) -> float:
    if trapezoid:
        return between(rng, 0.0182, 0.0192)
    if kind == "slim":
        return 0.009
    return 0.025 if chance(rng, 0.08) else 0.018


def _slider(rng: np.random.Generator, kind: str, slot: str) -> tuple[float, float, str]:
    long = between(rng, 0.012, 0.02) if kind == "slim" else between(rng, 0.016, 0.028)
    high = between(rng, 0.002, 0.004) if kind == "slim" else between(rng, 0.003, 0.006)
    wheel = 3.0 if slot == "face" and kind != "slim" else 0.0
    forms = {"hump": 3.0, "ramp": 2.0, "flat": 2.0, "wheel": wheel}
    return long, high, weighted(rng, forms)


def _belly(rng: np.random.Generator, kind: str, length: float, wide: float) -> Knots:
    """Distance of the side of the cutting edge from the blade's middle."""
    least = wide / 2 + 0.0014
    end = length / 2
    if kind == "slim":
        side = least + between(rng, 0.0004, 0.0025)
        return ((-end, side), (end, side if chance(rng, 0.6) else least))
    rear = least + between(rng, 0.001, 0.006)
    grip = least + between(rng, 0.002, 0.008)
    hollow = least + between(rng, 0.0004, 0.004)
    guard = hollow + (between(rng, 0.001, 0.005) if chance(rng, 0.5) else 0.0)
    course = pick(rng, ("straight", "bulged", "waved"))
    if course == "straight":
        return ((-end, grip), (0.3 * end, grip), (end, least + 0.0005))
    if course == "bulged":
        return ((-end, rear), (-0.3 * end, grip), (0.45 * end, hollow), (end, least))
    return (
        (-end, rear + 0.002),
        (-0.65 * end, hollow),
        (-0.1 * end, grip),
        (0.35 * end, hollow),
        (0.6 * end, guard),
        (end, least),
    )


def _thickness(rng: np.random.Generator, kind: str, length: float, cavity: float) -> Knots:
    low, high = {
        "slim": (0.0032, 0.0052),
        "snap": (0.0055, 0.0095),
        "metal": (0.0062, 0.0095),
        "grip": (0.0075, 0.0125),
    }[kind]
    most, end = between(rng, low, high), length / 2
    least = cavity + 0.0011
    nose = max(least, most * between(rng, 0.4, 0.85))
    if kind == "slim":
        return ((-end, most), (0.6 * end, most), (end, max(nose, 0.8 * most)))
    rear = most * between(rng, 0.75, 1.0)
    return ((-end, rear), (-0.2 * end, most), (0.4 * end, most), (0.75 * end, nose), (end, nose))


def _roundness(rng: np.random.Generator, kind: str) -> tuple[float, float]:
    if kind == "slim":
        return between(rng, 0.05, 0.25), between(rng, 0.2, 0.9)
    if kind == "grip":
        return between(rng, 0.3, 0.6), between(rng, 0.7, 1.0)
    return between(rng, 0.1, 0.45), between(rng, 0.4, 1.0)


def _ends(rng: np.random.Generator, kind: str) -> tuple[float, float]:
    if kind == "slim":
        return between(rng, 0.001, 0.006), between(rng, 0.001, 0.003)
    return between(rng, 0.003, 0.014), between(rng, 0.001, 0.006)
