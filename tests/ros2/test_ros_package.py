"""Pairs of messages, and the parts of the package that must agree with each other."""

import ast
import sys
from dataclasses import replace
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest
from r2art_ros.pairing import KEPT, Pairing, seconds
from r2art_ros.results import USED
from r2art_ros.settings import Settings, parameters
from ros_messages import PACKAGE


def message(sec, nanosec=0):
    stamp = SimpleNamespace(sec=sec, nanosec=nanosec)
    return SimpleNamespace(header=SimpleNamespace(stamp=stamp))


def test_images_meet_the_camera_info_of_their_moment():
    pairing = Pairing(slop=0.01)
    first, second = message(7, 999_999_999), message(8, 4_000_000)
    assert pairing.add_info(first) is None
    image = message(8)
    assert pairing.add_image(image) == (image, first)
    assert pairing.add_info(second) is None  # the image is gone
    image = message(8, 5_000_000)
    assert pairing.add_image(image) == (image, second)


def test_an_image_waits_for_its_camera_info_but_not_an_older_one():
    pairing = Pairing(slop=0.0)
    old, new = message(1), message(2)
    assert pairing.add_image(old) is None
    assert pairing.add_image(new) is None
    assert pairing.add_info(message(1)) is None
    info = message(2)
    assert pairing.add_info(info) == (new, info)


def test_stamps_of_years_keep_their_nanoseconds():
    pairing = Pairing(slop=0.0)
    pairing.add_info(message(1_700_000_000, 123_456_789))
    assert pairing.add_image(message(1_700_000_000, 123_456_788)) is None
    assert pairing.add_image(message(1_700_000_000, 123_456_789)) is not None


def test_what_waits_is_bounded():
    pairing = Pairing(slop=0.0)
    for sec in range(100):
        pairing.add_info(message(sec))
    assert pairing.add_image(message(99 - KEPT)) is None
    assert pairing.add_image(message(100 - KEPT)) is not None
    assert seconds(message(3, 500_000_000).header.stamp) == 3.5


def test_the_file_of_parameters_holds_the_defaults():
    lines = (PACKAGE / "config" / "r2art.yaml").read_text().splitlines()[3:]
    told = [line.strip().partition(":") for line in lines]
    found = {}
    for name, _, rest in told:
        value, _, about = (part.strip() for part in rest.partition("#"))
        text = {"true": "True", "false": "False"}.get(value, value)
        found[name] = (ast.literal_eval(text), about)
    assert found == {name: (default, about) for name, default, about in parameters()}
    for name, (default, _) in found.items():
        assert type(default) is type(getattr(Settings(), name)), name  # ROS fixes the types
    assert replace(Settings(), **{k: v for k, (v, _) in found.items()}) == Settings()


def imported(path):
    """Top names of what a module imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield (node.module or "").split(".")[0]


def test_package_xml_names_every_package_that_is_used():
    xml = ElementTree.parse(PACKAGE / "package.xml").getroot()
    assert xml.findtext("export/build_type") == "ament_python"
    depends = {d.text for d in xml.findall("exec_depend")}
    needed = {name.split("/")[0] for name in USED}
    for path in (PACKAGE / "r2art_ros" / "node.py", *(PACKAGE / "launch").glob("*.py")):
        needed |= set(imported(path))
    own = {"r2art", "r2art_ros", *sys.stdlib_module_names}
    assert needed - own <= depends


def test_only_the_node_imports_ros():
    for path in (PACKAGE / "r2art_ros").glob("*.py"):
        ros = {"rclpy", "sensor_msgs", "vision_msgs"} & set(imported(path))
        assert bool(ros) == (path.name == "node.py"), path


def test_setup_installs_what_is_there():
    tree = ast.parse((PACKAGE / "setup.py").read_text())
    name = ElementTree.parse(PACKAGE / "package.xml").getroot().findtext("name")
    text = ast.unparse(tree).replace("{NAME}", str(name))
    for path in ("resource/r2art_ros", "launch/r2art.launch.py", "config/r2art.yaml"):
        assert path in text
        assert (PACKAGE / path).exists()
    node = ast.parse((PACKAGE / "r2art_ros" / "node.py").read_text())
    assert "main" in {f.name for f in node.body if isinstance(f, ast.FunctionDef)}


@pytest.mark.parametrize("path", [*PACKAGE.rglob("*.py")], ids=lambda p: p.name)
def test_every_module_compiles(path):
    compile(path.read_text(), str(path), "exec")
