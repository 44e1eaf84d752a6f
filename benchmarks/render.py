"""Frames per second and core of the project's ray tracer, beside other renderers.

python benchmarks/render.py                              prints Markdown
python benchmarks/render.py --results docs/results.md    writes the page's section

All draw the same scenes in the same run, in turn. Embree (`pip install trimesh embreex`) and
MuJoCo's OpenGL (`pip install mujoco`, and Mesa's libOSMesa) are left out, with a line that says
so, where they are not installed.
"""

# pyright: reportAttributeAccessIssue=false
# MuJoCo describes its structures to type checkers only in part.

import argparse
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "osmesa")
os.environ.setdefault("LP_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

from r2art.core.camera import Camera
from r2art.data import shards
from r2art.data.categories import CATEGORIES, make_instance, staging
from r2art.data.pose import posed_vertices, root_T_part, transformed
from r2art.data.rendering.render import Scene, render, render_labels
from r2art.data.scenes import rooms, sky
from r2art.data.scenes.scene import make_sample
from r2art.data.scenes.surroundings import Surroundings
from r2art.data.shape import Surface
from r2art.data.staging import place_object
from r2art.learn.results import write_section

SIZES = ((224, 224), (640, 480))
HEAD = """| renderer | what | 224 × 224 | 640 × 480 | pixels labelled otherwise |
| --- | --- | ---: | ---: | ---: |"""

Labels = NDArray[np.integer]
Draw = Callable[[], Labels | None]
Renderer = Callable[[Scene, Camera], Draw]


@dataclass(frozen=True, kw_only=True)
class Row:
    """Mean seconds of a frame by size, and the share of pixels whose label is not ours."""

    name: str
    what: str
    seconds: tuple[float, ...]
    differs: float | None

    def __str__(self) -> str:
        rates = " | ".join(f"{1 / s:.1f}" for s in self.seconds)
        differs = "" if self.differs is None else f"{100 * self.differs:.2f} %"
        return f"| {self.name} | {self.what} | {rates} | {differs} |"


def view(category: str, seed: int, width: int, height: int) -> tuple[Scene, Camera]:
    """An object of a category on some ground, under one or two lamps."""
    rng = np.random.default_rng(seed)
    instance, stage = make_instance(category, seed), staging(category)
    state = stage.sample_joint_state(rng, instance.joints)
    world_T_part = root_T_part(instance.joints, state)
    points = posed_vertices(instance, world_T_part)
    square, cam_T_world, _ = place_object(stage.sample_view(rng), points, width)
    top = (width - height) / 2
    camera = Camera(square.fx, square.fy, square.cx, square.cy - top, width, height)
    ground = rooms.ground(rng, points.min(axis=0), points.max(axis=0), Surroundings())
    surfaces = [
        transformed(s, cam_T_world @ T)
        for part, T in zip(instance.parts, world_T_part, strict=True)
        for s in part
    ]
    labels = [k + 1 for k, part in enumerate(instance.parts) for _ in part] + [0] * len(ground)
    light = sky.some_sky(rng, ())
    scene = Scene(
        surfaces=[*surfaces, *(transformed(s, cam_T_world) for s in ground)],
        labels=labels,
        lights=sky.lights(rng, cam_T_world[:3, :3]),
        environment=light.radiance,
        world_R_cam=cam_T_world[:3, :3].T,
    )
    return scene, camera


def of_label(scene: Scene) -> dict[int, tuple[NDArray[np.floating], NDArray[np.integer]]]:
    """Vertices and faces of all surfaces of each label."""
    out = {}
    for label in sorted(set(scene.labels)):
        own: list[Surface] = [
            s for s, k in zip(scene.surfaces, scene.labels, strict=True) if k == label
        ]
        start = np.cumsum([0] + [len(s.vertices) for s in own[:-1]])
        faces = np.concatenate([s.faces + k for s, k in zip(own, start, strict=True)])
        out[label] = np.concatenate([s.vertices for s in own]), faces
    return out


def ours_in_colour(scene: Scene, camera: Camera) -> Draw:
    return lambda: render(scene, camera).label


def our_labels(scene: Scene, camera: Camera) -> Draw:
    return lambda: render_labels(scene.surfaces, scene.labels, camera)


def with_embree(scene: Scene, camera: Camera) -> Draw:
    """Labels and depth of one ray per pixel; the tree is built for every frame, as ours is."""
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    meshes = of_label(scene)
    mesh = trimesh.util.concatenate(
        [trimesh.Trimesh(vertices, faces, process=False) for vertices, faces in meshes.values()]
    )
    face_label = np.repeat(list(meshes), [len(faces) for _, faces in meshes.values()])
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    x, y = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
    rays = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3)
    origins = np.zeros_like(rays)

    def draw() -> Labels:
        face, ray, *place = RayMeshIntersector(mesh).intersects_id(
            origins, rays, multiple_hits=False, return_locations=True
        )
        label, depth = np.zeros(len(rays), int), np.zeros(len(rays))
        label[ray], depth[ray] = face_label[face], place[0][:, 2]
        return label.reshape(camera.height, camera.width)

    return draw


def with_mujoco(scene: Scene, camera: Camera) -> Draw:
    """Colour, labels and depth by OpenGL; the model is compiled before."""
    import mujoco

    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = camera.width, camera.height
    spec.visual.map.znear = 0.001
    meshes = of_label(scene)
    for label, (vertices, faces) in meshes.items():
        spec.add_mesh(
            name=str(label),
            uservert=(vertices * (1, -1, -1)).ravel(),
            userface=faces.ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH, meshname=str(label), name=str(label)
        )
    fovy = 2 * np.degrees(np.arctan(camera.height / 2 / camera.fy))
    spec.worldbody.add_camera(name="camera", fovy=fovy)
    for light in scene.lights:
        spec.worldbody.add_light(
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            dir=-np.array(light.direction) * (1, -1, -1),
            castshadow=True,
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = mujoco.Renderer(model, camera.height, camera.width)
    label_of = np.array([*(int(model.geom(k).name) for k in range(model.ngeom)), 0])

    def draw() -> Labels:
        renderer.update_scene(data, "camera")
        renderer.render()
        renderer.enable_depth_rendering()
        renderer.render()
        renderer.disable_depth_rendering()
        renderer.enable_segmentation_rendering()
        geom = renderer.render()[..., 0]
        renderer.disable_segmentation_rendering()
        return label_of[geom]

    return draw


def measured(renderer: Renderer, scenes: list[tuple[Scene, Camera]]) -> tuple[float, float]:
    """Mean CPU seconds of a frame, the faster of two runs each, and pixels labelled otherwise."""
    seconds, differs = 0.0, 0.0
    for scene, camera in scenes:
        draw = renderer(scene, camera)
        labels = draw()
        runs = []
        for _ in range(2):
            start = time.process_time()
            draw()
            runs.append(time.process_time() - start)
        seconds += min(runs) / len(scenes)
        truth = render_labels(scene.surfaces, scene.labels, camera)
        differs += float(np.mean(labels != truth)) / len(scenes)
    return seconds, differs


def compared(name: str, what: str, renderer: Renderer, count: int) -> str:
    """A line of the table; a renderer that does not run says why."""
    results = []
    for width, height in SIZES:
        scenes = [view(c, k, width, height) for c in CATEGORIES for k in range(count)]
        try:
            results.append(measured(renderer, scenes))
        except Exception as error:  # whatever a missing library or driver raises
            reason = str(error).partition("\n")[0] or type(error).__name__
            return f"| {name} | does not run here: {reason} | | | |"
    seconds = tuple(s for s, _ in results)
    return str(Row(name=name, what=what, seconds=seconds, differs=max(d for _, d in results)))


def whole_samples(count: int, backgrounds: Path | None) -> str:
    """From the object's shape to the encoded row of a dataset, square photos."""
    files = Surroundings.from_folder(backgrounds)
    seconds = []
    for width, height in SIZES:
        side = round((width * height) ** 0.5)
        make = partial(_sample, files=files, side=side)
        for category in CATEGORIES:
            for seed in range(count):
                make(category, seed)  # files are read, once
        start = time.process_time()
        for category in CATEGORIES:
            for seed in range(count):
                make(category, seed)
        seconds.append((time.process_time() - start) / (count * len(CATEGORIES)))
    what = "object made, surrounded, rendered with all labels, encoded"
    return str(Row(name="**r2art**, whole sample", what=what, seconds=tuple(seconds), differs=None))


def _sample(category: str, seed: int, *, files: Surroundings, side: int) -> None:
    instance = make_instance(category, seed, files.photos)
    rng = np.random.default_rng([seed, 1])
    shards.to_row(seed, make_sample(rng, instance, staging(category), files, side))


def report(count: int, backgrounds: Path | None, flags: str) -> str:
    """The section of docs/results.md."""
    shown = "colour, shadows, labels, depth"
    rows = [
        whole_samples(count, backgrounds),
        compared("**r2art**, `render`", shown, ours_in_colour, count),
        compared("**r2art**, `render_labels`", "labels", our_labels, count),
        compared("Embree (embreex)", "labels, depth", with_embree, count),
        compared("MuJoCo, software OpenGL", shown, with_mujoco, count),
    ]
    facts = (
        f"Frames per second of CPU time of one core, mean over {count * len(CATEGORIES)} scenes: "
        f"{count} of each category on some ground. `render` refines edges with further rays. "
        "Ours and Embree build their trees for every frame; MuJoCo compiles its model before. "
        "Whole samples are square, of as many pixels. The last column compares with "
        f"`render_labels`. Written by `python benchmarks/render.py{flags}`."
    )
    return "\n".join(["## Rendering", "", facts, "", HEAD, *rows])


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the renderer beside others.")
    parser.add_argument("-n", type=int, default=1, help="scenes of each category")
    parser.add_argument("--backgrounds", type=Path, help="folder of photos for whole samples")
    parser.add_argument("--results", type=Path, help="write the section on rendering of this page")
    args = parser.parse_args()
    flags = " --backgrounds DIR" if args.backgrounds else ""
    flags += " --results docs/results.md" if args.results else ""
    section = report(args.n, args.backgrounds, flags)
    print(section)
    if args.results:
        write_section(args.results, "render", section)


if __name__ == "__main__":
    main()
