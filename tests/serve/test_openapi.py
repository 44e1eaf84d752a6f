"""The description says what is true: it validates the answers, and its examples work."""

import json
import re

import jsonschema
import pytest

from r2art.core.prediction import SCHEMA_FILE, Prediction
from r2art.serve.openapi import EXAMPLE_FILE
from r2art.serve.options import PARAMETERS, read_options


@pytest.fixture(scope="module")
def page(served):
    return served.client.get("/openapi.json").json()


def schema_of(page, path, method, status="200", kind="application/json"):
    return page["paths"][path][method]["responses"][status]["content"][kind]["schema"]


def validate(page, schema, value):
    jsonschema.Draft202012Validator({**schema, "components": page["components"]}).validate(value)


def references(value):
    if isinstance(value, dict):
        for key, inner in value.items():
            if key == "$ref":
                yield inner
            yield from references(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from references(inner)


def test_every_reference_leads_somewhere(page):
    found = set(references(page))
    assert len(found) > 5
    for reference in found:
        assert re.fullmatch(r"#/components/schemas/\w+", reference)
        assert reference.rpartition("/")[2] in page["components"]["schemas"]


def test_answers_are_as_described(served, page, photo):
    for path in ("/health", "/categories"):
        validate(page, schema_of(page, path, "get"), served.client.get(path).json())
    good = served.client.post("/predict", files={"photo": photo})
    validate(page, schema_of(page, "/predict", "post"), good.json())
    bad = served.client.post("/predict", files={"mask": photo})
    schema = schema_of(page, "/predict", "post", "400", "application/problem+json")
    validate(page, schema, bad.json())
    with pytest.raises(jsonschema.ValidationError):
        validate(page, schema_of(page, "/predict", "post"), {**good.json(), "surplus": 1})
    with pytest.raises(jsonschema.ValidationError):
        validate(page, schema_of(page, "/predict", "post"), {**good.json(), "joints": [1]})


def test_examples_are_of_their_schema_and_are_understood(page):
    operation = page["paths"]["/predict"]["post"]
    assert [p["name"] for p in operation["parameters"]] == list(PARAMETERS)
    for parameter in operation["parameters"]:
        jsonschema.validate(parameter["example"], parameter["schema"])
        options = read_options([(parameter["name"], str(parameter["example"]))])
        assert getattr(options, parameter["name"]) is not None
    example = operation["responses"]["200"]["content"]["application/json"]["example"]
    jsonschema.validate(example, json.loads(SCHEMA_FILE.read_text(encoding="utf-8")))
    assert Prediction.from_json(EXAMPLE_FILE.read_text(encoding="utf-8")).image_path is None


def test_nothing_is_loaded_from_elsewhere(served, page):
    assert served.client.get("/docs").status_code == 404
    assert "http" not in json.dumps({k: v for k, v in page.items() if k != "components"})
