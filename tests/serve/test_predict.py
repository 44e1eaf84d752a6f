"""What a client gets over HTTP is what `Predictor.predict` says, in every way of asking."""

import json
import struct
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from xml.etree import ElementTree

import jsonschema
import numpy as np
import pytest
from PIL import Image
from serving import PNG, encoded, running

from r2art import cli
from r2art.core.camera import Camera
from r2art.core.prediction import SCHEMA_FILE
from r2art.serve.answers import ANSWERS
from r2art.serve.limits import Limits


def test_the_answer_is_what_the_command_line_prints(served, photo, tmp_path, capsys):
    (tmp_path / "photo.png").write_bytes(photo)
    assert cli.main(["predict", str(tmp_path / "photo.png"), "--json", "--size", "0.3"]) == 0
    printed = capsys.readouterr().out
    answer = served.client.post("/predict?size=0.3", content=photo, headers=PNG)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "application/json"
    path = json.dumps(str(tmp_path / "photo.png"))
    assert answer.text == printed.replace(f'"path": {path}', '"path": null')
    jsonschema.validate(answer.json(), json.loads(SCHEMA_FILE.read_text(encoding="utf-8")))


def test_form_and_raw_body_are_one(served, photo):
    raw = served.client.post(
        "/predict?fov=70&box=10,10,150,110&refine=2", content=photo, headers=PNG
    )
    fields = {"fov": "70", "box": "10,10,150,110", "refine": "2"}
    form = served.client.post("/predict", files={"photo": photo}, data=fields)
    mixed = served.client.post(
        "/predict?fov=70", files={"photo": photo}, data={"box": "10,10,150,110", "refine": "2"}
    )
    assert raw.status_code == 200
    assert raw.json() == form.json() == mixed.json()


@pytest.mark.parametrize("size", [{"size": "0.4"}, {"depth": "1.5"}])
def test_options_reach_the_prediction(served, predictor, photo, image, size):
    mask = np.zeros((120, 160), np.uint8)
    mask[20:90, 30:130] = 255
    mask_file = encoded(Image.fromarray(mask))
    category = predictor.categories[-1]
    options = {"camera": "150,151,80,60", "category": category, "refine": "3", **size}
    answer = served.client.post(
        "/predict", files={"photo": photo, "mask": ("m.png", mask_file)}, data=options
    )
    expected = predictor.predict(
        image,
        Camera(150, 151, 80, 60, 160, 120),
        category,
        refine=3,
        mask=mask,
        **{name: float(value) for name, value in size.items()},
    )
    assert answer.json() == json.loads(expected.to_json())


def test_every_kind_of_photo_is_read(served, predictor, image):
    rotation = image.getexif()
    rotation[0x0112] = 6
    kinds = {
        "GIF": encoded(image.convert("P"), "GIF"),
        "JPEG": encoded(image, "JPEG", exif=rotation),
        "WEBP": encoded(image.convert("RGBA"), "WEBP"),
        "BMP": encoded(image.convert("L"), "BMP"),
    }
    for kind, content in kinds.items():
        headers = {"Content-Type": "image/jpeg"}  # what the content is, it tells itself
        answer = served.client.post("/predict", content=content, headers=headers).json()
        assert answer == json.loads(predictor.predict(content).to_json()), kind
        size = (answer["image"]["width"], answer["image"]["height"])
        assert size == ((120, 160) if kind == "JPEG" else (160, 120))


def test_a_body_in_chunks_is_a_body(served, photo):
    def pieces():
        for k in range(0, len(photo), 1000):
            yield photo[k : k + 1000]

    chunked = served.client.post("/predict", content=pieces(), headers=PNG)
    assert chunked.request.headers["transfer-encoding"] == "chunked"
    whole = served.client.post("/predict", content=photo, headers=PNG)
    assert chunked.json() == whole.json()


def test_every_format_is_of_its_type(served, photo, predictor):
    for name, kind in ANSWERS.items():
        answer = served.client.post("/predict", files={"photo": photo}, data={"format": name})
        assert answer.status_code == 200, name
        assert answer.headers["content-type"].split(";")[0] == kind.media_type
        assert answer.headers["content-disposition"].endswith(f'{kind.suffix}"')
        if name == "glb":
            assert struct.unpack("<4sII", answer.content[:12]) == (b"glTF", 2, len(answer.content))
        elif name == "overlay":
            with Image.open(BytesIO(answer.content)) as picture:
                assert picture.format == "PNG"
                picture.load()
        elif kind.media_type == "application/xml":
            ElementTree.fromstring(answer.content)
    assert {"json", "glb", "overlay", "urdf"} <= set(ANSWERS)


def test_clients_at_once_get_their_own_answers(served, photo, image):
    other = encoded(image.transpose(Image.Transpose.ROTATE_180))
    expected = [
        served.client.post("/predict", content=content, headers=PNG).json()
        for content in (photo, other)
    ]
    assert expected[0] != expected[1]

    def ask(k):
        return served.client.post("/predict", content=(photo, other)[k % 2], headers=PNG).json()

    with ThreadPoolExecutor(6) as clients:
        answers = list(clients.map(ask, range(12)))
    assert answers == expected * 6


def test_categories_are_those_of_the_model(served, predictor):
    told = served.client.get("/categories").json()
    assert [c["name"] for c in told] == list(predictor.categories)
    for category in told:
        known = predictor.category(category["name"])
        assert category["parts"] == list(known.parts)
        assert [j["child"] for j in category["joints"]] == list(known.parts[1:])
        assert [tuple(j["limits"]) for j in category["joints"]] == [j.limits for j in known.joints]


def test_health_answers(served):
    health = served.client.get("/health").json()
    assert health["status"] == "ok"
    assert health["taken"] == 0
    assert health["places"] == 18


@pytest.mark.parametrize("as_form", [False, True])
def test_a_large_photo_is_taken_whole(predictor, as_form):
    """Nothing between the client and the limits has a smaller limit of its own."""
    noise = np.random.default_rng(0).integers(0, 256, (1500, 2000, 3), np.uint8)
    content = encoded(Image.fromarray(noise), "BMP")
    assert len(content) > 8e6
    with running(predictor, Limits(megabytes=10)) as served:
        if as_form:
            answer = served.client.post("/predict?refine=0", files={"photo": content})
        else:
            answer = served.client.post("/predict?refine=0", content=content, headers=PNG)
    assert answer.status_code == 200
    assert answer.json()["image"]["width"] == 2000
