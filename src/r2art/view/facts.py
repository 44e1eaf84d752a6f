"""What the viewer writes beside the picture: HTML of a prediction's numbers and warnings.

Every text that comes from a file, a model or a user is escaped: names are never markup.
"""

from html import escape

import numpy as np

from r2art.core.legend import CAMERA, state_text
from r2art.core.palette import Color, part_color
from r2art.core.prediction import JointEstimate, PartEstimate, Prediction


def facts(prediction: Prediction) -> str:
    """Category, confidence, why it is rejected, warnings, and tables of parts and joints."""
    score = prediction.category_score
    sure = "as given" if score is None else f"{score:.0%} sure"
    distance = float(np.linalg.norm(prediction.parts[0].cam_T_part[:3, 3]))
    notes = [f"{distance:.2f} m away", CAMERA[prediction.camera_source], _scale(prediction)]
    if (fit := prediction.refinement) is not None:
        notes.append(f"outline off by {100 * fit.residual:.1f} %")
    parts = "".join(_part_row(part, p) for p, part in enumerate(prediction.parts))
    joints = "".join(
        _joint_row(joint, part_color(j + 1)) for j, joint in enumerate(prediction.joints)
    )
    return (
        f'<div class="r2art-facts"><h1>{escape(prediction.category)} <small>{sure}</small></h1>'
        f"<p>{' · '.join(map(escape, notes))}</p>"
        + _rejected(prediction)
        + "".join(f'<p class="r2art-warning">{escape(text)}</p>' for text in prediction.warnings)
        + "<table><tr><th>part</th><th>sure</th><th>x y z (m)</th><th>size (cm)</th></tr>"
        f"{parts}</table>"
        + "<table><tr><th>joint</th><th>kind</th><th>state</th><th>limits</th><th>sure</th></tr>"
        f"{joints}</table></div>"
    )


def message(text: str, *, kind: str = "note") -> str:
    """A line in a box: a ``note``, an ``error``, or ``busy``."""
    role = "alert" if kind == "error" else "status"
    return f'<div class="r2art-message r2art-{kind}" role="{role}">{escape(text)}</div>'


def _rejected(prediction: Prediction) -> str:
    if prediction.rejected is None:
        return ""
    return f'<p class="r2art-rejected" role="alert">Rejected: {escape(prediction.rejected)}</p>'


def _scale(prediction: Prediction) -> str:
    scale = prediction.scale
    if scale.source != "prior":
        return f"scale from the given {scale.source}"
    spread = "" if scale.spread is None else f" (± {scale.spread:.0%})"
    return f"scale of usual objects{spread}"


def _part_row(part: PartEstimate, index: int) -> str:
    place = " ".join(f"{v:.2f}" for v in part.cam_T_part[:3, 3])
    size = " × ".join(f"{100 * v:.1f}" for v in part.box_size)
    return (
        f"<tr><td>{_swatch(part_color(index))}{escape(part.name)}</td>"
        f"<td>{part.confidence:.0%}</td><td>{place}</td><td>{size}</td></tr>"
    )


def _joint_row(joint: JointEstimate, color: Color) -> str:
    low, high = (state_text(joint, limit) for limit in joint.limits)
    sure = "–" if joint.confidence is None else f"{joint.confidence:.0%}"
    return (
        f"<tr><td>{_swatch(color)}{escape(joint.name)}</td><td>{joint.kind}</td>"
        f"<td><b>{state_text(joint)}</b></td><td>{low} to {high}</td><td>{sure}</td></tr>"
    )


def _swatch(color: Color) -> str:
    return f'<i style="background:rgb{color}"></i>'
