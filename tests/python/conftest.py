"""What the tests share: the command, and a scene of the bundled sample's kind made with it."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import strandlight as sl


def _command() -> str:
    command = os.environ.get("STRANDLIGHT")
    assert command, "STRANDLIGHT names the command to compare with"
    return command


@pytest.fixture(scope="session")
def strandlight():
    """Calls the command; its standard output."""

    def call(*words: object, stdin: str | None = None) -> str:
        run = subprocess.run(
            [_command(), *map(str, words)], input=stdin, capture_output=True, text=True
        )
        assert run.returncode == 0, f"strandlight {words}: {run.stderr}"
        return run.stdout

    return call


def sky(height: int = 64) -> np.ndarray:
    """A map with a sun, a gradient and a coloured wall."""
    rows, columns = np.mgrid[0:height, 0 : 2 * height]
    pixels = np.empty((height, 2 * height, 3), np.float32)
    pixels[..., 0] = 0.3 + 0.4 * columns / (2 * height)
    pixels[..., 1] = 0.4
    pixels[..., 2] = 1.0 - 0.5 * rows / height
    sun = (rows - height // 4) ** 2 + (columns - height // 2) ** 2 < (height / 24) ** 2
    pixels[sun] += 40.0
    return pixels


@pytest.fixture(scope="session")
def folder(tmp_path_factory, strandlight) -> Path:
    """`sky.exr`, `sky.lights`, `bob.groom`, `scene.toml`, made with the command."""
    folder = tmp_path_factory.mktemp("scene")
    write_exr(folder / "sky.exr", sky())
    strandlight("lights", folder / "sky.exr", "-o", folder / "sky.lights", "--count", 12)
    strandlight(
        "groom", "generate", "--style", "bob", "--strands", 400, "--points-per-strand", 12,
        "-o", folder / "bob.groom",
    )
    (folder / "scene.toml").write_text(
        "version = 1\n[groom]\nfile = 'bob.groom'\n[lights]\nfile = 'sky.lights'\n"
        "[hair]\npreset = 'auburn'\n[render]\nsize = [96, 64]\n"
    )
    return folder


def write_exr(path: Path, pixels: np.ndarray) -> None:
    """An OpenEXR map of these pixels, by way of a picture."""
    rgba = np.ones((*pixels.shape[:2], 4), np.float32)
    rgba[..., :3] = pixels
    rgba.view(sl.Picture).save(path)
