"""Scenes that Strandlight and others trace alike: generated hair, maps drawn here, camera, film."""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from strands import Strands

Array = NDArray[np.float64]

WIDTH, HEIGHT = 96, 64
FOV_DEG = 26.0
EYE, TARGET = (34.0, 8.0, 62.0), (0.0, -3.0, -1.0)
MAP_WIDTH, MAP_HEIGHT = 64, 32


@dataclass(frozen=True)
class Hair:
    """What a scene file says of the fibres: degrees and standard deviations."""

    sigma_a: tuple[float, float, float]
    eta: float = 1.55
    shift_deg: tuple[float, float, float] = (-7.0, 3.5, 10.5)
    width_deg: tuple[float, float, float] = (7.0, 3.5, 14.0)
    caustic_width_deg: float = 6.0


@dataclass(frozen=True)
class Scene:
    """Hair under a map."""

    name: str
    hair: Hair
    style: str
    strands: int
    diameter: float
    """cm"""


SCENES = [
    Scene("dark-sun", Hair((0.9, 1.3, 2.0)), "wavy", 3000, 0.016),
    Scene("blond-soft", Hair((0.06, 0.1, 0.2)), "wavy", 3000, 0.016),
]


def pixel_directions(width: int, height: int) -> Array:
    """Of pixel centres, [row, column, xyz]: OpenEXR's layout, +Z in the middle, +X a quarter from the left."""
    lat = np.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    lon = np.pi - 2.0 * np.pi * (np.arange(width) + 0.5) / width
    return np.stack(np.broadcast_arrays(np.cos(lat) * np.sin(lon), np.sin(lat), np.cos(lat) * np.cos(lon)), -1)


def radiance(name: str) -> Array:
    """The map of a scene, linear, [row, column, rgb]; constant over each pixel."""
    omega = pixel_directions(MAP_WIDTH, MAP_HEIGHT)
    up = omega[..., 1:2]
    if name == "blond-soft":
        side = omega @ np.array([0.8, 0.3, 0.5])
        return np.array([1.0, 0.95, 0.9]) * (0.6 + 0.3 * up) + np.array([0.5, 0.4, 0.3]) * np.maximum(side, 0.0)[..., None] ** 2
    sky = np.array([0.10, 0.14, 0.22]) * (1.0 + 0.5 * up) + np.array([0.05, 0.04, 0.03]) * (up < 0.0)
    sky = sky.copy()
    # A sun of 2 x 2 pixels, behind the hair and above: 9 degrees across, most of the light.
    sky[9:11, 8:10] = np.array([190.0, 170.0, 140.0])
    sky[11:13, 44:46] = np.array([40.0, 45.0, 50.0])
    return sky


def energy(pixels: Array) -> Array:
    """Integral over the sphere of a map of constant pixels."""
    edges = np.sin(np.pi * (0.5 - np.arange(pixels.shape[0] + 1) / pixels.shape[0]))
    solid = 2.0 * np.pi / pixels.shape[1] * -np.diff(edges)
    return np.einsum("hwc,h->c", pixels, solid)


class Work:
    """A scene's files in a folder, and Strandlight's pictures of it."""

    def __init__(self, strandlight: str, folder: str, scene: Scene, model: str = "marschner") -> None:
        self.strandlight = os.path.abspath(strandlight)
        self.folder = os.path.abspath(folder)
        self.scene = scene
        self.model = model
        self._make()

    def at(self, ending: str) -> str:
        return os.path.join(self.folder, self.scene.name + ending)

    def run(self, *words: object) -> str:
        command = [self.strandlight, *map(str, words)]
        run = subprocess.run(command, capture_output=True, text=True, cwd=self.folder)
        if run.returncode != 0:
            raise RuntimeError(f"{' '.join(command)}: {run.stderr.strip()}")
        return run.stdout

    def _make(self) -> None:
        scene, hair = self.scene, self.scene.hair
        self.pixels = radiance(scene.name).astype(np.float32).astype(np.float64)
        write_map(self.at(".exr"), self.pixels)
        # The path tracer takes its light from --map; a scene needs a light set all the same.
        self.run("lights", self.at(".exr"), "--count", 4, "--no-report", "-o", self.at(".lights"))
        words = ["--style", scene.style, "--strands", scene.strands, "--points-per-strand", 64, "--seed", 4]
        self.run("groom", "generate", *words, "-o", self.at(".coarse.groom"))
        self.run("export", self.at(".coarse.groom"), "--to", "mitsuba", "-o", self.at(".coarse.txt"))
        self.strands = Strands.read(self.at(".coarse.txt")).smooth(2, 0.5 * scene.diameter)
        self.strands.write(self.at(".txt"))
        self.run("groom", "import", self.at(".txt"), "--unit", "cm", "--up", "y", "-o", self.at(".groom"))
        self.strands.write(self.at(".spline.txt"), phantom_ends=True)
        names = ("r", "tt", "trt")
        table = {
            "shift_deg": dict(zip(names, hair.shift_deg)),
            "width_deg": dict(zip(names, hair.width_deg)),
        }
        inline = {key: ", ".join(f"{mode} = {x}" for mode, x in modes.items()) for key, modes in table.items()}
        with open(self.at(".toml"), "w", encoding="utf-8") as file:
            file.write(
                f"version = 1\n[groom]\nfile = '{scene.name}.groom'\n[lights]\nfile = '{scene.name}.lights'\n"
                f"[hair]\nmodel = '{self.model}'\nsigma_a = {list(hair.sigma_a)}\neta = {hair.eta}\n"
                f"shift_deg = {{ {inline['shift_deg']} }}\nwidth_deg = {{ {inline['width_deg']} }}\n"
                f"caustic_width_deg = {hair.caustic_width_deg}\ndiameter_cm = {scene.diameter}\n"
                f"[camera]\nposition = {list(EYE)}\ntarget = {list(TARGET)}\nup = [0.0, 1.0, 0.0]\n"
                f"fov_deg = {FOV_DEG}\n[render]\nsize = [{WIDTH}, {HEIGHT}]\nbackground = 'none'\n"
            )

    def is_as_given(self) -> tuple[float, float]:
        """Longest segment as a share of a fortieth of the groom's diameter, and largest turn between two in
        degrees: below 1 and 8 Strandlight takes the points as they are, without points between them."""
        points = self.strands.points
        centre = 0.5 * (points.min(0) + points.max(0))
        limit = np.linalg.norm(points - centre, axis=1).max() / 20.0
        longest, turn = 0.0, 0.0
        for strand in self.strands.strands():
            way = np.diff(strand, axis=0)
            length = np.linalg.norm(way, axis=1, keepdims=True)
            longest = max(longest, float(length.max()) / limit)
            way /= length
            cosine = np.clip((way[1:] * way[:-1]).sum(1), -1.0, 1.0)
            turn = max(turn, float(np.degrees(np.arccos(cosine).max())))
        return longest, turn

    def ours(self, seed: int, samples: int) -> dict[str, Array]:
        """`reference --method path --map`: layers `single` and `total`, and `alpha`; [row, column, rgb]."""
        out = self.at(f".{seed}.ours.exr")
        self.run(
            "reference", self.at(".toml"), "--method", "path", "--map", self.at(".exr"), "--samples", samples,
            "--seed", seed, "-o", out,
        )  # fmt: skip
        return layers_of(out)


def write_map(file: str, pixels: Array) -> None:
    """As OpenEXR, in single precision."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": np.ascontiguousarray(pixels.astype(np.float32))}).write(file)


def channels_of(file: str) -> dict[str, Array]:
    """Channels of a picture by name, [row, column]."""
    channels = OpenEXR.File(file, separate_channels=True).channels()
    return {name: channel.pixels.astype(np.float64) for name, channel in channels.items()}


def layers_of(file: str) -> dict[str, Array]:
    """Layers of a picture of `reference`."""
    values = channels_of(file)
    layers = {name: np.stack([values[f"{name}.{c}"] for c in "RGB"], -1) for name in ("single", "total")}
    layers["alpha"] = np.repeat(values["A"][..., None], 3, -1)
    return layers
