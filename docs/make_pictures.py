"""Draws the pictures of the docs: one per category that shows the conventions.

Run from the repository's root after `pip install -e '.[train]'`:

    python docs/make_pictures.py

Every picture is an object of the project's own generators, under its true pose. With `--examples`
it renders the example photos anew; with `--photos` it draws what the shipped model says about them
(docs/images/prediction.jpg); with `--gallery` it draws where that model fails; with `--sheets` it
draws 30 instances and 12 photos per category; `--overview` cuts the README's picture from these
sheets.
With `--urdf PATH --name NAME` it draws all of that of a model:

    python docs/make_pictures.py --urdf panda_arm_hand.urdf --name panda --fix 'panda_finger_joint*'
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

import r2art
from r2art.core.image import read_image
from r2art.core.prediction import Prediction
from r2art.data.categories import CATEGORIES, make_instance, staging
from r2art.data.models.build import Reading
from r2art.data.models.imported import imported
from r2art.data.objects import Objects, Procedural, instance_seed
from r2art.data.pose import posed_vertices, root_T_part, transformed
from r2art.data.prior import category_prior
from r2art.data.rendering.render import GAMMA, Light, Scene, render
from r2art.data.sample import Sample
from r2art.data.scenes.scene import make_sample
from r2art.data.scenes.surroundings import Surroundings
from r2art.data.shape import Instance
from r2art.data.staging import View, place_object
from r2art.data.synth import Synth, synthesise
from r2art.learn.evaluation.scores import truth

ROOT = Path(__file__).resolve().parent.parent
SIZE = 800  # px
STUDIO = 0.82  # linear grey of the backdrop
EXPOSURE = 0.5  # of the object before it


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What a category's picture shows.

    Attributes:
        seed: Which object.
        states: Of its joints: degrees or metres.
        azimuth: Of the camera, in degrees ...
        elevation: ... from where the sides are told apart.
    """

    seed: int
    states: tuple[float, ...]
    azimuth: float = 32
    elevation: float = 28


SHOWN = {
    "laptop": Shown(seed=14, states=(108,)),
    "drawer": Shown(seed=13, states=(0.0, 0.22, 0.1)),
    "drawer_single": Shown(seed=109, states=(0.2,)),
    "box": Shown(seed=103, states=(75,)),
    "dishwasher": Shown(seed=204, states=(65,)),
    "microwave": Shown(seed=2, states=(80,), azimuth=20),
    "eyeglasses": Shown(seed=105, states=(85, 60), elevation=40),
    "scissors": Shown(seed=101, states=(40,), azimuth=20, elevation=62),
    "stapler": Shown(seed=108, states=(35,), azimuth=55, elevation=22),
    "cutter": Shown(seed=108, states=(0.03,), azimuth=60, elevation=45),
}
# Which of the 30 instances of a sheet stands for its category.
OVERVIEW = {
    "laptop": 0,
    "eyeglasses": 4,
    "dishwasher": 1,
    "scissors": 4,
    "drawer": 1,
    "drawer_single": 1,
    "box": 5,
    "stapler": 1,
    "cutter": 1,
    "microwave": 1,
    "panda": 1,
    "iiwa7": 1,
}
ARM_SHARE = 0.5  # of the range of its joints: how an arm is shown
# Objects of the test split (seed, index) that lie within the middle three quarters of the picture.
EXAMPLES = {"laptop": (1, 52), "drawer": (1, 78)}
EXIF_FOLDER, FOCAL_LENGTH_35MM = 0x8769, 0xA405
DIAGONAL_35MM = 43.27  # mm

ABOVE_RIGHT = View(
    azimuth=np.radians(32),
    elevation=np.radians(28),
    roll=0.0,
    fov=np.radians(36),
    fill=0.78,
    place=(0.5, 0.5),
)


def studio_lights(cam_R_root: np.ndarray) -> tuple[Light, ...]:
    """Two soft lamps, from the upper left and from the right."""
    lamps = ((-0.5, 0.8, 0.6, 2.2), (0.8, 0.5, 0.4, 0.9))
    directions = [cam_R_root @ np.array(d[:3]) / np.linalg.norm(d[:3]) for d in lamps]
    return tuple(
        Light(direction=tuple(d.tolist()), color=(lamp[3], lamp[3], lamp[3]), radius=0.12)
        for d, lamp in zip(directions, lamps, strict=True)
    )


def photograph(
    instance: Instance, joint_state: np.ndarray, view: View = ABOVE_RIGHT, size: int = SIZE
) -> Sample:
    """One object on a plain backdrop."""
    root_T_parts = root_T_part(instance.joints, joint_state)
    camera, cam_T_root, box = place_object(view, posed_vertices(instance, root_T_parts), size)
    cam_T_part = cam_T_root @ root_T_parts
    surfaces, labels = [], []
    for k, part in enumerate(instance.parts):
        surfaces += [transformed(surface, cam_T_part[k]) for surface in part]
        labels += [k + 1] * len(part)
    scene = Scene(
        surfaces=surfaces,
        labels=labels,
        lights=studio_lights(cam_T_root[:3, :3]),
        environment=np.full((16, 32, 3), 0.9, np.float32),
        world_R_cam=cam_T_root[:3, :3].T,
        show_environment=False,
    )
    frame = render(scene, camera, seed=0)
    radiance = EXPOSURE * frame.rgb + (1 - frame.coverage[..., None]) * STUDIO
    pixels = (255 * np.clip(radiance, 0, 1) ** (1 / GAMMA) + 0.5).astype(np.uint8)
    box_center, box_size = instance.part_boxes()
    return Sample(
        image=pixels,
        mask=frame.label,
        depth=frame.depth,
        camera=camera,
        box=box,
        cam_T_part=cam_T_part,
        joint_state=joint_state,
        box_center=box_center,
        box_size=box_size,
        axis=np.array([j.axis for j in instance.joints]),
        pivot=np.array([j.pivot for j in instance.joints]),
        visible=np.ones(len(instance.parts)),
    )


def arm_shown(arm: Objects) -> Shown:
    """An arm from its side, each joint at the same share of its range."""
    limits = np.array([joint.limits for joint in arm.instance(0).joints])
    states = limits[:, 0] + ARM_SHARE * (limits[:, 1] - limits[:, 0])
    return Shown(seed=0, states=tuple(np.degrees(states).tolist()), azimuth=60, elevation=15)


def shown(objects: Objects, what: Shown) -> Prediction:
    """One object and its true pose, as a prediction that can be drawn."""
    instance = objects.instance(what.seed)
    turns = [joint.kind == "revolute" for joint in instance.joints]
    states = np.where(turns, np.radians(what.states), what.states)
    angles = np.radians((what.azimuth, what.elevation))
    view = replace(ABOVE_RIGHT, azimuth=float(angles[0]), elevation=float(angles[1]))
    sample = photograph(instance, states, view)
    names = replace(category_prior([instance], objects.staging), joints=instance.joints)
    return replace(truth(sample, names), photo=read_image(sample.image))


def draw_convention(folder: Path, objects: Objects, what: Shown) -> None:
    """The picture of one category: part boxes, joint axes and the root frame."""
    picture = shown(objects, what).draw().convert("RGB")
    _save(picture, folder / f"convention_{objects.name}.jpg")


def draw_instances(folder: Path, objects: Objects, columns: int = 6, rows: int = 5) -> None:
    """A sheet of instances as photos show them: each with its joints, from a typical view."""
    how, side = objects.staging, 256

    def picture(i: int) -> Image.Image:
        rng = np.random.default_rng(i)
        instance = objects.instance(instance_seed(objects.name, "val", 0, i))
        joint_state = how.sample_joint_state(rng, instance.joints)
        view = replace(how.sample_view(rng), roll=0.0, fov=ABOVE_RIGHT.fov, fill=0.85)
        sample = photograph(instance, joint_state, replace(view, place=(0.5, 0.5)), 2 * side)
        return Image.fromarray(sample.image).resize((side, side), Image.Resampling.LANCZOS)

    _save(_sheet(picture, columns, rows, side), folder / f"instances_{objects.name}.jpg")


def draw_scenes(folder: Path, objects: Objects, columns: int = 4, rows: int = 3) -> None:
    """A sheet of photos as `r2art synth` makes them, without foreign pictures."""
    job = Synth(
        objects=objects,
        n=columns * rows,
        seed=0,
        split="val",
        size=320,
        backgrounds=None,
        out=folder,
    )
    sheet = _sheet(lambda i: Image.fromarray(synthesise(job, i).image), columns, rows, job.size)
    _save(sheet, folder / f"scenes_{objects.name}.jpg")


def _sheet(
    picture: Callable[[int], Image.Image], columns: int, rows: int, side: int
) -> Image.Image:
    sheet = Image.new("RGB", (columns * side, rows * side))
    for i in range(columns * rows):
        sheet.paste(picture(i), (i % columns * side, i // columns * side))
    return sheet


def draw_overview(folder: Path) -> None:
    """One object of every category and a robot arm, cut from their sheets, for the README."""
    side = 256
    sheet = Image.new("RGB", (6 * side, 2 * side), "white")
    for i, (name, tile) in enumerate(OVERVIEW.items()):
        with Image.open(folder / f"instances_{name}.jpg") as instances:
            cell = instances.width // 6
            left, top = tile % 6 * cell, tile // 6 * cell
            picture = instances.crop((left, top, left + cell, top + cell)).resize((side, side))
        sheet.paste(picture, (i % 6 * side, i // 6 * side))
    _save(sheet, folder / "overview.jpg")


def _save(picture: Image.Image, path: Path) -> None:
    picture.save(path, quality=82, optimize=True)
    print(f"wrote {path}")


def render_examples(folder: Path, width: int = 640, height: int = 480) -> None:
    """Photos without any foreign picture in them; their focal length stands in the EXIF data."""
    for category, (seed, index) in EXAMPLES.items():
        seed = instance_seed(category, "test", seed, index)
        rng = np.random.default_rng([seed, 1])
        sample = make_sample(
            rng, make_instance(category, seed), staging(category), Surroundings(), width
        )
        top = (width - height) // 2
        exif = Image.Exif()
        focal = sample.camera.fx * DIAGONAL_35MM / np.hypot(width, height)
        exif[EXIF_FOLDER] = {FOCAL_LENGTH_35MM: round(focal)}
        photo = Image.fromarray(sample.image[top : top + height])
        photo.save(folder / f"{category}.png", exif=exif, optimize=True)
        print(f"wrote {folder / category}.png")


def draw_examples(folder: Path) -> None:
    """The example photos with what the shipped model says, side by side."""
    predictor = r2art.load()
    photos = sorted((ROOT / "examples").glob("*.png"))
    drawn = [predictor.predict(photo).draw() for photo in photos]
    height = min(picture.height for picture in drawn)
    drawn = [p.resize((round(p.width * height / p.height), height)) for p in drawn]
    sheet = Image.new("RGB", (sum(p.width for p in drawn), height), "white")
    left = 0
    for picture in drawn:
        sheet.paste(picture, (left, 0))
        left += picture.width
    sheet.thumbnail((1600, 1600))
    sheet.save(folder / "prediction.jpg", quality=88)
    print(f"wrote {folder / 'prediction.jpg'}")


def main() -> None:
    """Draw the pictures that were asked for."""
    parser = argparse.ArgumentParser(description="Draw the pictures of the docs.")
    parser.add_argument("--examples", action="store_true", help="render the example photos anew")
    parser.add_argument("--photos", action="store_true", help="draw the example photos too")
    parser.add_argument("--gallery", action="store_true", help="only draw where the model fails")
    parser.add_argument("--sheets", nargs="*", help="only draw sheets of these categories (or all)")
    parser.add_argument("--overview", action="store_true", help="only cut it from the sheets")
    parser.add_argument("--urdf", type=Path, help="only draw this arm of seven joints")
    parser.add_argument("--name", help="what the arm is called")
    parser.add_argument("--fix", nargs="*", default=(), help="joints of the arm to hold still")
    args = parser.parse_args()
    folder = ROOT / "docs" / "images"
    folder.mkdir(exist_ok=True)
    if args.urdf is not None:
        reading = Reading(fix=tuple(args.fix))
        arm = imported("urdf", [args.urdf], name=args.name, reading=reading, recolor=True)
        draw_convention(folder, arm, arm_shown(arm))
        draw_instances(folder, arm)
        draw_scenes(folder, arm)
        return
    if args.sheets is not None:
        for category in args.sheets or CATEGORIES:
            draw_instances(folder, Procedural(category))
            draw_scenes(folder, Procedural(category))
        draw_overview(folder)
        return
    if args.overview:
        draw_overview(folder)
        return
    if args.gallery:
        from gallery import draw_gallery

        draw_gallery(folder)
        return
    for category, what in SHOWN.items():
        draw_convention(folder, Procedural(category), what)
    if args.examples:
        render_examples(ROOT / "examples")
    if args.photos:
        draw_examples(folder)


if __name__ == "__main__":
    main()
