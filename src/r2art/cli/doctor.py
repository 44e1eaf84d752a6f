"""`r2art doctor`: is everything in place?"""

import json as json_format
import time
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from tyro.conf import arg

from r2art.core.errors import ModelError
from r2art.run.report import say

if TYPE_CHECKING:
    from r2art.run.selftest import Difference

FAULTS_FOUND = 1
SHOWN = 3
"""So many missing packages are named."""


def doctor(*, json: Annotated[bool, arg(help_behavior_hint="")] = False) -> int:
    """Check the installation: versions, extras, the model, and a prediction.

    The model must be the one this r2art was released with, and say of a photo inside the package
    what it said then. Exit code 0 if so, else 1. Extras are optional: a missing one is no fault.

    Put what it prints into every bug report.

    Args:
        json: Print one JSON object instead.
    """
    from r2art.run.installation import extras, versions

    report: dict[str, Any] = {"versions": versions(), "extras": extras()}
    try:
        faults = _check_model(report)
    except ModelError as error:
        faults = [str(error)]
    report["faults"] = faults
    if json:
        print(json_format.dumps(report))
    else:
        _print(report)
    for fault in faults:
        say("error", fault)
    return FAULTS_FOUND if faults else 0


def _check_model(report: dict[str, Any]) -> list[str]:
    """Add what is known of the model; what is wrong with it.

    Raises:
        ModelError: It is missing or damaged.
    """
    from r2art.run import selftest
    from r2art.run.predictor import SHIPPED_MODEL, load

    faults = []
    wanted, found = selftest.expected(), selftest.model_sha256()
    same = found == wanted.model_sha256
    report["model"] = {"path": str(SHIPPED_MODEL), "sha256": found, "as_released": same}
    if not same:
        faults.append(
            f"the model is not the one of this release (sha256 {found[:12]}…, not "
            f"{wanted.model_sha256[:12]}…); reinstall r2art, or after replacing it on purpose run "
            "`python -m r2art.run.selftest`"
        )
    predictor = load()
    report["model"]["categories"] = list(predictor.categories)
    start = time.perf_counter()
    difference = selftest.difference(selftest.predict(predictor), wanted.prediction)
    seconds = round(time.perf_counter() - start, 3)
    outcome = {"passed": difference.is_small, "seconds": seconds}
    report["self_test"] = outcome | asdict(difference)
    if not difference.is_small:
        faults.append(
            f"the self-test predicts something else than at release ({_differs(difference)}); "
            "reinstall r2art and onnxruntime, and report this"
        )
    return faults


def _differs(difference: "Difference") -> str:
    if not difference.same_category:
        return f"a {difference.category}"
    rotation, joint = np.degrees([difference.rotation, difference.joint])
    return f"{rotation:.2f}° in rotation, {joint:.2f}° in joints, {difference.length:.2%} in place"


def _print(report: dict[str, Any]) -> None:
    rows = dict(report["versions"])
    for extra, missing in report["extras"].items():
        rows[f"extra {extra}"] = f"lacks {_some(missing)}" if missing else "complete"
    if model := report.get("model"):
        rows["model"] = f"{model['path']}, sha256 {model['sha256'][:12]}…"
        rows["as released"] = "yes" if model["as_released"] else "no"
        rows["categories"] = ", ".join(model.get("categories", []))
    if test := report.get("self_test"):
        outcome = "passed" if test["passed"] else "failed"
        rows["self-test"] = f"{outcome} ({test['category']}, {1000 * test['seconds']:.0f} ms)"
    width = max(map(len, rows))
    for name, value in rows.items():
        print(f"{name:<{width}}  {value}")


def _some(names: list[str]) -> str:
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more
