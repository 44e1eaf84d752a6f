"""What the server takes and gives, as OpenAPI 3.1, with examples.

FastAPI writes down the small pages by itself. `/predict` reads its body as it comes, which
FastAPI knows nothing of; its description is put together here from what reads it.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from r2art.core.prediction import SCHEMA_FILE, Prediction
from r2art.run.files import SUFFIXES
from r2art.serve.answers import ANSWERS
from r2art.serve.limits import Limits
from r2art.serve.options import PARAMETERS
from r2art.serve.problems import MEDIA_TYPE, SCHEMA, Kind
from r2art.serve.upload import FORM

EXAMPLE_FILE = Path(__file__).with_name("example.json")
COMPONENTS = "#/components/schemas/"
OF_PREDICT = (
    Kind.MALFORMED_REQUEST,
    Kind.SLOW_UPLOAD,
    Kind.TOO_LARGE,
    Kind.WRONG_MEDIA_TYPE,
    Kind.UNUSABLE_OPTION,
    Kind.UNUSABLE_IMAGE,
    Kind.FAULT,
    Kind.BUSY,
    Kind.SLOW_ANSWER,
)


def describe(app: FastAPI, categories: Sequence[str], limits: Limits) -> None:
    """Let an application describe itself, ``/predict`` and the prediction's schema included."""

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            page = get_openapi(
                title=app.title, version=app.version, summary=app.summary, routes=app.routes
            )
            # Afterwards, for FastAPI would drop what is null in an example.
            page["components"]["schemas"] |= {"Problem": SCHEMA, **prediction_schemas()}
            page["paths"]["/predict"]["post"] |= predict_operation(categories, limits)
            app.openapi_schema = page
        return app.openapi_schema

    app.openapi = openapi


def prediction_schemas() -> dict[str, Any]:
    """The schema of the prediction and of its pieces, each under a name of its own."""
    schema = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
    pieces = schema.pop("$defs")
    for key in ("$schema", "$id"):
        del schema[key]
    found = {"Prediction": schema}
    found |= {_component(name): piece for name, piece in pieces.items()}
    return {name: _redirected(piece) for name, piece in found.items()}


def _component(name: str) -> str:
    return f"Prediction_{name}"


def _redirected(value: Any) -> Any:
    """The same with references to ``$defs`` turned into references to components."""
    if isinstance(value, dict):
        return {
            k: COMPONENTS + _component(v.rpartition("/")[2]) if k == "$ref" else _redirected(v)
            for k, v in value.items()
        }
    return [_redirected(v) for v in value] if isinstance(value, list) else value


def predict_operation(categories: Sequence[str], limits: Limits) -> dict[str, Any]:
    """Parameters, body and responses of ``POST /predict``."""
    schemas = _option_schemas(categories)
    return {
        "parameters": [
            {
                "name": name,
                "in": "query",
                "required": False,
                "description": parameter.description,
                "schema": schemas[name],
                "example": parameter.example,
            }
            for name, parameter in PARAMETERS.items()
        ],
        "requestBody": _body(schemas, limits),
        "responses": {"200": _success(), **_problems()},
    }


def _option_schemas(categories: Sequence[str]) -> dict[str, dict[str, Any]]:
    schemas = {name: dict(parameter.schema) for name, parameter in PARAMETERS.items()}
    schemas["category"]["enum"] = list(categories)
    schemas["format"]["enum"] = list(ANSWERS)
    return schemas


def _body(schemas: dict[str, dict[str, Any]], limits: Limits) -> dict[str, Any]:
    fields = {
        name: {**schemas[name], "description": parameter.description}
        for name, parameter in PARAMETERS.items()
    }
    image = {"type": "string", "contentMediaType": "image/*"}
    mask = "White where the object is seen, of the photo's size."
    form = {
        "type": "object",
        "required": ["photo"],
        "additionalProperties": False,
        "properties": {"photo": image, "mask": {**image, "description": mask}, **fields},
    }
    return {
        "required": True,
        "description": f"The photo ({', '.join(sorted(s[1:] for s in SUFFIXES))}), by itself or "
        f"in a form; at most {limits.megabytes:g} MB and {limits.megapixels:g} megapixels. "
        "An option may come in the address or in the form, not in both.",
        "content": {FORM: {"schema": form}, "image/*": {"schema": image}},
    }


def _success() -> dict[str, Any]:
    example = Prediction.from_json(EXAMPLE_FILE.read_text(encoding="utf-8")).to_dict()
    content: dict[str, Any] = {
        a.media_type: {"schema": {"type": "string", "contentMediaType": a.media_type}}
        for a in ANSWERS.values()
    }
    content["application/json"] = {
        "schema": {"$ref": COMPONENTS + "Prediction"},
        "example": example,
    }
    formats = "; ".join(f"{name}: {a.about}" for name, a in ANSWERS.items())
    return {"description": f"The prediction, by `format`. {formats}.", "content": content}


def _problems() -> dict[str, Any]:
    found: dict[str, Any] = {}
    for kind in OF_PREDICT:
        known = found.setdefault(str(kind.status), {"description": ""})
        known["description"] = f"{known['description']} {kind.title}.".strip()
        known["content"] = {MEDIA_TYPE: {"schema": {"$ref": COMPONENTS + "Problem"}}}
        if kind in (Kind.BUSY, Kind.SLOW_ANSWER):
            seconds = {"type": "integer", "minimum": 1}
            after = {"description": "Seconds until another try is worth it.", "schema": seconds}
            known["headers"] = {"Retry-After": after}
    return found
