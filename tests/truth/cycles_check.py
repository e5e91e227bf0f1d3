"""Another outside judge: Blender Cycles traces the same strands under the same map from the same camera as
`strandlight reference --method path --map`, with its own hair material.

python cycles_check.py STRANDLIGHT TMPDIR

Run with a Python that has bpy, numpy and OpenEXR. Checks, with a line for each:

1. the map alone, pixel by pixel: camera, orientation and radiance;
2. coverage: strands and their widths;
3. `hair.model = "energy"` without tilt, against the model of Chiang et al. in Cycles: the same model there;
4. Marschner's model against it, another model: ratios stay where they were measured;
5. that 1, 3 and 4 notice a mirrored map and fibres that are off;
and says how far Cycles' other model, that of Huang et al., is from it, and what both path tracers cost.

Exit code 1 if a check fails; TMPDIR/cycles.json has the numbers.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import in_blender
import scenes
from chiang import azimuthal_roughness, longitudinal_roughness
from in_blender import Job, frame_of
from findings import FOUND, check, end, note, timed
from scenes import EYE, FOV_DEG, HEIGHT, MAP_HEIGHT, MAP_WIDTH, SCENES, TARGET, WIDTH, Hair, Scene
from statistics_of import Verdict, compare
from timing import PICTURES, Timed, ours_of

Array = NDArray[np.float64]

# Samples per pixel of each picture.
OUR_SAMPLES, CYCLES_SAMPLES = 16, 48
# Of these, where a difference is to be seen and not to be ruled out.
COARSE = 0.25
# Events after the first. Blond hair scatters most: after 200 there is nothing left.
BOUNCES = {"single": 0, "total": 500}
# Cycles over ours on 2026-11-30: ratio of the mean colour, and RMS difference of tiles.
MEASURED: dict[str, tuple[Array, Array]] = {
    "dark-sun single": (np.array([1.099, 1.095, 1.089]), np.array([0.110, 0.105, 0.098])),
    "dark-sun total": (np.array([1.099, 1.089, 1.080]), np.array([0.121, 0.105, 0.093])),
    "blond-soft single": (np.array([1.092, 1.089, 1.085]), np.array([0.098, 0.096, 0.091])),
    "blond-soft total": (np.array([1.192, 1.170, 1.136]), np.array([0.202, 0.178, 0.142])),
}
# Beside 4 standard errors of the ratio; a mirrored map moves blond-soft by 0.03, dark-sun by 0.3.
RATIO_LIMIT, RMS_LIMIT = 0.01, 0.03
COVERAGE_LIMIT = 0.003


def chiang(hair: Hair, azimuthal_deg: float, **changes: Any) -> dict[str, Any]:
    """Inputs of Cycles' node for these fibres: the same index and absorption, the same variance of R, TT and TRT along
    the fibre, and R shifted alike. Its TT is then shifted alike, TRT by 4/3 of it."""
    return {
        "Absorption Coefficient": list(hair.sigma_a),
        "IOR": hair.eta,
        # Positive where R is shifted towards the root.
        "Offset": float(np.radians(-hair.shift_deg[0])),
        "Roughness": longitudinal_roughness(hair),
        "Radial Roughness": azimuthal_roughness(azimuthal_deg),
        "Coat": 0.0,
        "Random Roughness": 0.0,
    } | changes


def huang(hair: Hair) -> dict[str, Any]:
    """The same for Cycles' other model, of rough facets of GGX: their Beckmann counterparts have the width of R."""
    roughness = float(np.sqrt(2.0) * np.tan(np.radians(hair.width_deg[0])))
    return {name: value for name, value in chiang(hair, 1.0).items() if name not in ("Coat", "Radial Roughness")} | {
        "Roughness": roughness,
        "Aspect Ratio": 1.0,
    }


class Work(scenes.Work):
    """A scene's files, and both renderers of it."""

    def cycles(self, jobs: list[Job]) -> tuple[Array, list[float]]:
        """Pictures rgba and the processor time of each."""
        np.savez(self.at(".npz"), points=self.strands.points, lengths=self.strands.lengths)
        work = in_blender.Work(
            self.at(".npz"), self.strands.radius, EYE, TARGET, float(np.radians(FOV_DEG)), (WIDTH, HEIGHT), jobs
        )
        work.write(self.at(".jobs.json"))
        command = [sys.executable, in_blender.__file__, self.at(".jobs.json"), self.at(".seconds.json")]
        run = subprocess.run(command, capture_output=True, text=True)
        if run.returncode != 0:
            raise RuntimeError(f"Blender: {run.returncode}\n{run.stdout[-800:]}\n{run.stderr[-800:]}")
        with open(self.at(".seconds.json"), encoding="utf-8") as text:
            seconds = json.load(text)
        channels = [scenes.channels_of(job.out) for job in jobs]
        return np.array([np.stack([picture[c] for c in "RGBA"], -1) for picture in channels]), seconds

    def job(self, **values: Any) -> Job:
        return Job(**{"out": self.at(".cycles.exr"), "map": self.at(".exr"), "seed": 0, "samples": 1} | values)

    def traced(self, samples: int, seed: int, **values: Any) -> Timed:
        """Pictures with seeds of their own; time without what a picture of one sample takes, which follows the first
        and so finds the strands' tree made."""
        jobs = [self.job(samples=1, seed=seed, out=self.at(f".{k}.cycles.exr"), **values) for k in range(2)]
        jobs += [
            self.job(samples=samples, seed=seed + 1 + k, out=self.at(f".{2 + k}.cycles.exr"), **values) for k in range(PICTURES)
        ]
        pictures, seconds = self.cycles(jobs)
        return Timed(pictures[2:], sum(seconds[2:]) - PICTURES * seconds[1])


def expected(pixels: Array) -> tuple[Array, Array]:
    """The map alone in the scene's camera: colours of pixel centres, and where a pixel sees one pixel of the map."""
    right, up, back = frame_of(np.array(EYE), np.array(TARGET))
    half = np.tan(0.5 * np.radians(FOV_DEG))
    found = []
    for dx, dy in [(0.5, 0.5), (0, 0), (0, 1), (1, 0), (1, 1)]:
        x = (2.0 * (np.arange(WIDTH) + dx) / WIDTH - 1.0) * half * WIDTH / HEIGHT
        y = (1.0 - 2.0 * (np.arange(HEIGHT) + dy) / HEIGHT) * half
        omega = x[None, :, None] * right + y[:, None, None] * up - back
        omega /= np.linalg.norm(omega, axis=-1, keepdims=True)
        row = (0.5 - np.arcsin(omega[..., 1]) / np.pi) * MAP_HEIGHT
        column = (np.pi - np.arctan2(omega[..., 0], omega[..., 2])) / (2.0 * np.pi) * MAP_WIDTH
        found.append(np.floor(row).astype(int) * MAP_WIDTH + np.floor(column).astype(int) % MAP_WIDTH)
    is_whole = np.all([corner == found[0] for corner in found], axis=0)
    return pixels.reshape(-1, 3)[found[0]], is_whole


def check_map(work: Work) -> None:
    """A map of random colours, which nothing but the right direction shows."""
    pixels = np.random.default_rng(1).uniform(0.0, 4.0, (MAP_HEIGHT, MAP_WIDTH, 3)).astype(np.float32)
    for name, shown in [("as it is", pixels), ("mirrored", pixels[:, ::-1])]:
        scenes.write_map(work.at(".random.exr"), shown)
        picture = work.cycles([work.job(map=work.at(".random.exr"), samples=4)])[0][0, ..., :3]
        colours, is_whole = expected(pixels.astype(np.float64))
        off = np.abs(picture / colours - 1.0).max(-1)[is_whole]
        share = float((off < 1e-5).mean())
        FOUND[f"map {name}"] = share
        is_right = share == 1.0 if name == "as it is" else share < 0.1
        check(is_right, f"the map, {name}: {100 * share:.1f} % of {is_whole.sum()} pixels show its colour, to {off.max():.1e}")


def near_measured(key: str, verdict: Verdict) -> bool:
    """Whether mean colour and difference of tiles are what they were when they were measured."""
    ratio, rms = MEASURED[key]
    limit = RATIO_LIMIT + 4.0 * verdict.error
    return bool(np.all(np.abs(verdict.ratio - ratio) < limit) and np.all(np.abs(verdict.rms - rms) < RMS_LIMIT))


def is_same(verdict: Verdict) -> bool:
    """Of one model in both. Where rays go on, and tangents along a segment, are not the same in both: tiles differed by
    up to 0.5 %."""
    return bool(np.all(np.abs(verdict.ratio - 1.0) < 0.002 + 4.0 * verdict.error) and np.all(verdict.rms < 0.01))


def told(verdict: Verdict) -> str:
    ratio, error, rms = [" ".join(form.format(x) for x in values) for form, values in
                         [("{:.3f}", verdict.ratio), ("{:.4f}", verdict.error), ("{:.1f}", 100 * verdict.rms)]]  # fmt: skip
    return f"{ratio} of ours +- {error}, tiles differ by {rms} %"


def check_scene(strandlight: str, folder: str, scene: Scene) -> None:
    """A scene with both renderers, then with the map mirrored and the fibres tilted the other way."""
    work = Work(strandlight, folder, scene)
    name, hair = scene.name, scene.hair
    ours = ours_of(work, OUR_SAMPLES)
    samples = CYCLES_SAMPLES
    usual = chiang(hair, hair.caustic_width_deg)
    theirs = {
        layer: work.traced(samples, 1000 * (k + 1), bounces=bounces, hair=usual)
        for k, (layer, bounces) in enumerate(BOUNCES.items())
    }
    alpha = compare(np.repeat(theirs["single"].pictures[..., 3:], 3, -1), ours["alpha"].pictures)
    note(f"{name} coverage", alpha)
    off = float(np.abs(alpha.ratio - 1.0).max())
    check(off < COVERAGE_LIMIT, f"{name}, coverage: {alpha}")
    for layer in BOUNCES:
        verdict = compare(theirs[layer].pictures[..., :3], ours[layer].pictures)
        note(f"{name} {layer}", verdict)
        check(near_measured(f"{name} {layer}", verdict), f"{name}, {layer}: Chiang is {told(verdict)}")
    costs = {"ours": ours["total"].seconds_to(0.01), "cycles": theirs["total"].seconds_to(0.01)}
    FOUND[f"{name} core-seconds to 1 % of tiles"] = costs
    print(f"        {name}: core-seconds to 1 % noise of tiles of 8 x 8 pixels, total: "
          f"{costs['ours']:.1f} here, {costs['cycles']:.1f} Cycles")  # fmt: skip
    coarse = round(COARSE * samples)
    scenes.write_map(work.at(".mirrored.exr"), work.pixels[:, ::-1])
    wrong: dict[str, dict[str, Any]] = {
        "a mirrored map": {"map": work.at(".mirrored.exr"), "hair": usual},
        "cuticle tilted the other way": {"hair": usual | {"Offset": -usual["Offset"]}},
    }
    for k, (what, changes) in enumerate(wrong.items()):
        theirs_wrong = work.traced(coarse, 10_000 * (k + 1), bounces=BOUNCES["total"], **changes)
        verdict = compare(theirs_wrong.pictures[..., :3], ours["total"].pictures)
        note(f"{name} {what}", verdict)
        check(not near_measured(f"{name} total", verdict), f"{name}, {what}: noticed; {told(verdict)}")
    for k, (layer, bounces) in enumerate(BOUNCES.items()):
        other = work.traced(coarse, 50_000 + 1000 * k, bounces=bounces, model="HUANG", hair=huang(hair))
        verdict = compare(other.pictures[..., :3], ours[layer].pictures)
        note(f"{name} {layer} by Huang's model", verdict)
        print(f"        {name}, {layer}: Huang is {told(verdict)}", flush=True)


def check_energy(strandlight: str, folder: str, scene: Scene) -> None:
    """Model `energy` without tilt and with sharp TRT is Chiang's with next to no azimuthal roughness. Cycles takes the
    offset h from the hit, which is even on average."""
    hair = replace(scene.hair, shift_deg=(0.0, 0.0, 0.0), caustic_width_deg=1.0)
    work = Work(strandlight, folder, replace(scene, hair=hair), model="energy")
    ours = ours_of(work, OUR_SAMPLES, seed=500)
    samples = CYCLES_SAMPLES
    usual = chiang(hair, 1.0)
    for k, (layer, bounces) in enumerate(BOUNCES.items()):
        theirs = work.traced(samples, 80_000 + 1000 * k, bounces=bounces, hair=usual)
        verdict = compare(ours[layer].pictures, theirs.pictures[..., :3])
        note(f"{scene.name} {layer} energy", verdict)
        check(is_same(verdict), f"{scene.name}, {layer}, model energy against Chiang's in Cycles: {verdict}")
    wrong = {
        "a tenth less absorption": {"Absorption Coefficient": [0.9 * x for x in hair.sigma_a]},
    }
    for k, (what, changes) in enumerate(wrong.items()):
        theirs = work.traced(samples, 90_000 + 1000 * k, bounces=BOUNCES["total"], hair=usual | changes)
        verdict = compare(ours["total"].pictures, theirs.pictures[..., :3])
        note(f"{scene.name} energy, {what}", verdict)
        check(not is_same(verdict), f"{scene.name}, model energy, {what}: noticed; {verdict}")


def main() -> int:
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    strandlight, folder = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    os.makedirs(folder, exist_ok=True)
    timed("the map", lambda: check_map(Work(strandlight, folder, SCENES[1])))
    for scene in SCENES:
        timed(scene.name, lambda: check_scene(strandlight, folder, scene))
    timed("model energy", lambda: check_energy(strandlight, folder, SCENES[1]))
    return end(os.path.join(folder, "cycles.json"))


if __name__ == "__main__":
    sys.exit(main())
