"""Blender's side of `cycles_check.py`, in a process of its own: pictures by Cycles.

Not named `cycles`, as a module of Blender's is.

python in_blender.py WORK.json SECONDS.json

Run with a Python that has Blender's module `bpy`. Writes each job's picture, and the processor time of each to
SECONDS.json.
"""

from __future__ import annotations

import json
import resource
import sys
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# From our axes to Blender's: z is up there, and the middle of a map, our +Z, lies at +X.
AXES = (2, 0, 1)


@dataclass(frozen=True)
class Job:
    """A picture of the scene, or without hair of the map alone."""

    out: str
    map: str
    seed: int
    samples: int
    bounces: int = 0
    """Events after the first; 0 is single scattering."""
    model: str = "CHIANG"
    hair: dict[str, Any] = field(default_factory=dict)
    """Inputs of the node Principled Hair BSDF, angles in radians; none for the map alone."""
    shape: str = "THICK_LINEAR"


@dataclass(frozen=True)
class Work:
    """What the pictures of a run have in common."""

    strands: str
    """Points and lengths of strands, as .npz."""
    radius: float
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    fov: float
    """Of the height, radians."""
    size: tuple[int, int]
    jobs: list[Job]

    def write(self, file: str) -> None:
        with open(file, "w", encoding="utf-8") as text:
            json.dump(asdict(self), text)

    @staticmethod
    def read(file: str) -> Work:
        with open(file, encoding="utf-8") as text:
            values = json.load(text)
        jobs = [Job(**job) for job in values.pop("jobs")]
        return Work(**values, jobs=jobs)


def to_blender(points: Array) -> Array:
    return points[..., AXES]


def frame_of(eye: Array, target: Array) -> Array:
    """Right, up and back of a camera, in rows; in our axes."""
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross([0.0, 1.0, 0.0], back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back])


def settings(bpy: Any, work: Work) -> None:
    """Of the picture: linear, unclamped, one sample a place, nothing blurred and nothing left out."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = work.size
    scene.render.resolution_percentage = 100
    # Strands and their tree are made once for all pictures.
    scene.render.use_persistent_data = True
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth, image.exr_codec = "OPEN_EXR", "RGBA", "32", "ZIP"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_guiding = cycles.use_fast_gi = False
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = cycles.blur_glossy = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.transparent_max_bounces = 1024


def camera(bpy: Any, work: Work) -> None:
    from mathutils import Matrix

    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "VERTICAL"
    data.angle = work.fov
    data.clip_start, data.clip_end = 0.1, 1000.0
    item = bpy.data.objects.new("camera", data)
    eye, target = np.array(work.eye), np.array(work.target)
    matrix = np.eye(4)
    matrix[:3, :3] = to_blender(frame_of(eye, target)).T
    matrix[:3, 3] = to_blender(eye)
    item.matrix_world = Matrix(matrix.tolist())
    bpy.context.scene.collection.objects.link(item)
    bpy.context.scene.camera = item


def strands(bpy: Any, work: Work) -> Any:
    """Curves of Blender's, a unit of length to the centimetre."""
    with np.load(work.strands) as file:
        points, lengths = file["points"], file["lengths"]
    data = bpy.data.hair_curves.new("hair")
    data.add_curves(lengths.tolist())
    data.attributes["position"].data.foreach_set("vector", to_blender(points).astype(np.float32).ravel())
    radius = data.attributes.get("radius") or data.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(len(points), work.radius, np.float32))
    item = bpy.data.objects.new("hair", data)
    bpy.context.scene.collection.objects.link(item)
    return item


def world(bpy: Any) -> Any:
    """A map as the world; says the node that holds it."""
    sky = bpy.data.worlds.new("world")
    sky.use_nodes = True
    bpy.context.scene.world = sky
    nodes, links = sky.node_tree.nodes, sky.node_tree.links
    nodes.clear()
    texture = nodes.new("ShaderNodeTexEnvironment")
    # Constant over each pixel, as here.
    texture.interpolation = "Closest"
    background, out = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeOutputWorld")
    links.new(texture.outputs["Color"], background.inputs["Color"])
    links.new(background.outputs["Background"], out.inputs["Surface"])
    return texture


def material(bpy: Any, item: Any) -> Any:
    """The node Principled Hair BSDF on the strands."""
    made = bpy.data.materials.new("hair")
    made.use_nodes = True
    nodes = made.node_tree.nodes
    nodes.clear()
    bsdf, out = nodes.new("ShaderNodeBsdfHairPrincipled"), nodes.new("ShaderNodeOutputMaterial")
    made.node_tree.links.new(bsdf.outputs["BSDF"], out.inputs["Surface"])
    bsdf.parametrization = "ABSORPTION"
    item.data.materials.append(made)
    return bsdf


def used() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def main() -> int:
    import bpy

    work = Work.read(sys.argv[1])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    settings(bpy, work)
    camera(bpy, work)
    hair, texture = strands(bpy, work), world(bpy)
    bsdf = material(bpy, hair)
    scene, seconds, previous = bpy.context.scene, [], None
    for job in work.jobs:
        image = bpy.data.images.load(job.map, check_existing=True)
        if texture.image != image:
            image.colorspace_settings.name = "Non-Color"
            texture.image = image
        # Set anew, even to the same, it would have the strands' tree made again.
        if hair.hide_render == bool(job.hair):
            hair.hide_render = not job.hair
        scene.render.film_transparent = bool(job.hair)
        if previous is None or (job.model, job.hair) != (previous.model, previous.hair):
            bsdf.model = job.model
            for name, value in job.hair.items():
                bsdf.inputs[name].default_value = value
        scene.cycles_curves.shape = job.shape
        scene.cycles.seed, scene.cycles.samples = job.seed, job.samples
        for kind in ("max", "diffuse", "glossy", "transmission"):
            setattr(scene.cycles, f"{kind}_bounces", job.bounces)
        scene.render.filepath = job.out
        start = used()
        bpy.ops.render.render(write_still=True)
        seconds.append(used() - start)
        previous = job
    with open(sys.argv[2], "w", encoding="utf-8") as text:
        json.dump(seconds, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
