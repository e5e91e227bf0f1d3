"""An outside judge of ground truth: Mitsuba 3 traces the same strands, fibres, camera and map as
`strandlight reference --method path --map`.

python truth_check.py STRANDLIGHT TMPDIR [--quick] [--costs]

Run with a Python that has mitsuba and numpy. Checks, with a line for each:

1. the fibre of `fibre.py`, written from the documentation's formulas, against `strandlight probe`;
2. single and total scattering of two scenes against Mitsuba's path tracer with that fibre, by statistics of tiles;
3. that the same comparison fails for fibres a little off;
4. `hair.model = "energy"` without tilt, against Mitsuba's own hair material: the same model there;
and says how far Mitsuba's own material is from Marschner's model, and what both path tracers and `render --converge` cost.

`--quick` traces a quarter of the samples; `--costs` does nothing but the last. Exit code 1 if a check fails; TMPDIR/truth.json has the numbers.
"""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from typing import Any

import numpy as np

import variant  # noqa: F401
from chiang import azimuthal_roughness, longitudinal_roughness
from costs import costs
from fibre_check import check_itself, check_probe
from findings import check, end, note, timed
from mitsuba_scenes import InMitsuba, energy_in_mitsuba, fibre_of, mi, traced
from scenes import SCENES, Hair, Scene, energy
from statistics_of import compare
from timing import PICTURES, Timed, ours_of, used

# Samples per pixel of each picture.
OUR_SAMPLES, MITSUBA_SAMPLES = 64, 192
# Of these, where a difference is to be seen and not to be ruled out.
COARSE = 0.25
DEPTHS = {"single": 2, "total": -1}
# Fibres that are a little off, which the comparison must notice.
WRONG: dict[str, dict[str, Any]] = {
    "cuticle tilted the other way": {"shift_deg": (7.0, -3.5, -10.5)},
    "eta 1.50": {"eta": 1.50},
    "a tenth less absorption": {},
}


def mitsubas(scene: mi.Scene, depth: int, samples: int, seed: int, n: int = PICTURES) -> Timed:
    """`n` pictures rgba of Mitsuba; time without that of the first call, which compiles."""
    traced(scene, depth, seed, 1)
    start = used()
    pictures = [traced(scene, depth, seed + 1 + number, samples) for number in range(n)]
    return Timed(np.array(pictures), used() - start)


def beside_mitsubas_time(work: InMitsuba, mitsuba: mi.Scene, ours: Timed, theirs: Timed) -> None:
    """What errors of all scattering cost here and in Mitsuba."""
    depth = DEPTHS["total"]
    costs(work, lambda seed, n: traced(mitsuba, depth, seed, n)[..., :3], ours, theirs)


def only_costs(strandlight: str, folder: str, scene: Scene, share: float) -> None:
    """What errors cost in a scene, and what Mitsuba takes for loading it and for compiling: nothing for the latter where an
    earlier run left the code in ~/.drjit."""
    work = InMitsuba(strandlight, folder, scene)
    depth = DEPTHS["total"]
    start = used()
    mitsuba = work.mitsuba(work.scattering())
    traced(mitsuba, depth, 0, 1)
    first = used() - start
    print(f"        {scene.name}: Mitsuba's scene and first call {first:.1f} core-s", flush=True)
    samples = round(share * MITSUBA_SAMPLES)
    theirs = mitsubas(mitsuba, depth, samples, 2000)
    own = work.mitsuba_with_its_hair(own_hair(scene.hair, azimuthal_roughness(scene.hair.caustic_width_deg)))
    ratio = mitsubas(own, depth, samples, 3000, 3).core_seconds / 3 / (theirs.core_seconds / PICTURES)
    print(f"        {scene.name}: a sample of Mitsuba's own hair takes {ratio:.2f} times as long", flush=True)
    ours = ours_of(work, round(share * OUR_SAMPLES))["total"]
    beside_mitsubas_time(work, mitsuba, ours, theirs)


def check_scene(strandlight: str, folder: str, scene: Scene, share: float) -> None:
    """A scene with both renderers, then with fibres that are a little off."""
    work = InMitsuba(strandlight, folder, scene)
    longest, turn = work.is_as_given()
    check(longest < 1.0 and turn < 8.0, f"{scene.name}: {len(work.strands.points)} points, which Strandlight takes as they are")
    mitsuba = work.mitsuba(work.scattering())
    off = np.abs(energy_in_mitsuba(mitsuba) / energy(work.pixels) - 1.0).max()
    check(off < 1e-4, f"{scene.name}: the map's energy in Mitsuba is off by {off:.1e}")
    ours = ours_of(work, round(share * OUR_SAMPLES))
    samples = round(share * MITSUBA_SAMPLES)
    theirs = {name: mitsubas(mitsuba, depth, samples, 1000 * (k + 1)) for k, (name, depth) in enumerate(DEPTHS.items())}
    alpha = compare(ours["alpha"].pictures, np.repeat(theirs["single"].pictures[..., 3:], 3, -1))
    note(f"{scene.name} coverage", alpha)
    check(alpha.agrees(), f"{scene.name}, coverage: {alpha}")
    for name in DEPTHS:
        verdict = compare(ours[name].pictures, theirs[name].pictures[..., :3])
        note(f"{scene.name} {name}", verdict)
        check(verdict.agrees(), f"{scene.name}, {name}: {verdict}")
    beside_mitsubas_time(work, mitsuba, ours["total"], theirs["total"])
    check_wrong(work, ours, round(COARSE * samples))
    beside_mitsubas_hair(work, ours, round(COARSE * samples))


def check_wrong(work: InMitsuba, ours: dict[str, Timed], samples: int) -> None:
    """The comparison notices fibres that are a little off."""
    for number, (what, changes) in enumerate(WRONG.items()):
        sigma = tuple(0.9 * x for x in work.scene.hair.sigma_a)
        wrong = work.mitsuba(work.scattering(**(changes or {"sigma_a": sigma})))
        theirs = mitsubas(wrong, DEPTHS["total"], samples, 10_000 * (number + 1))
        verdict = compare(ours["total"].pictures, theirs.pictures[..., :3])
        note(f"{work.scene.name} {what}", verdict)
        check(
            not verdict.agrees(),
            f"{work.scene.name}, {what}: noticed; {verdict.z_of_ratio():.1f} standard errors of the mean colour, "
            f"{verdict.z_of_tiles():.1f} of the tiles' z^2",
        )


def own_hair(hair: Hair, azimuthal: float) -> dict[str, Any]:
    """Mitsuba's material (Chiang et al. 2016) for these fibres: the same index and absorption, the same variance of
    R, TT and TRT along the fibre, and R shifted alike. Its TT is then shifted alike, TRT by 4/3 of it."""
    scale = max(hair.sigma_a)
    return {
        "type": "hair",
        "longitudinal_roughness": longitudinal_roughness(hair),
        "azimuthal_roughness": azimuthal,
        "scale_tilt": hair.shift_deg[0],
        "int_ior": hair.eta,
        "ext_ior": 1.0,
        # A colour may not be above 1.
        "sigma_a": {"type": "rgb", "value": [x / scale for x in hair.sigma_a]},
        "scale": scale,
    }


def beside_mitsubas_hair(work: InMitsuba, ours: dict[str, Timed], samples: int) -> None:
    """How far Mitsuba's own material is; another model, so no check."""
    name, hair = work.scene.name, work.scene.hair
    scene = work.mitsuba_with_its_hair(own_hair(hair, azimuthal_roughness(hair.caustic_width_deg)))
    for k, (layer, depth) in enumerate(DEPTHS.items()):
        verdict = compare(mitsubas(scene, depth, samples, 50_000 + 1000 * k).pictures[..., :3], ours[layer].pictures)
        note(f"{name} {layer} by Mitsuba's hair", verdict)
        ratio = " ".join(f"{x:.3f}" for x in verdict.ratio)
        print(f"        {name}, {layer}: Mitsuba's own hair is {ratio} of it, tiles differ by "
              f"{' '.join(f'{100 * x:.1f}' for x in verdict.rms)} %", flush=True)  # fmt: skip


def check_energy(strandlight: str, folder: str, scene: Scene, share: float) -> None:
    """Model `energy` without tilt and with sharp TRT is Mitsuba's material with next to no azimuthal roughness: lobes
    of d'Eon, N at theta_o, all orders. Mitsuba takes the offset h from the hit, which is even on average."""
    hair = replace(scene.hair, shift_deg=(0.0, 0.0, 0.0), caustic_width_deg=1.0)
    work = InMitsuba(strandlight, folder, replace(scene, hair=hair), model="energy")
    samples = round(share * MITSUBA_SAMPLES)
    ours = ours_of(work, round(share * OUR_SAMPLES), seed=500)
    mitsuba = work.mitsuba_with_its_hair(own_hair(hair, azimuthal_roughness(1.0)))
    for k, (layer, depth) in enumerate(DEPTHS.items()):
        theirs = mitsubas(mitsuba, depth, samples, 80_000 + 1000 * k)
        verdict = compare(ours[layer].pictures, theirs.pictures[..., :3])
        note(f"{scene.name} {layer} energy", verdict)
        check(verdict.agrees(), f"{scene.name}, {layer}, model energy against Mitsuba's own hair: {verdict}")


def main() -> int:
    words = [word for word in sys.argv[1:] if word not in ("--quick", "--costs")]
    if len(words) != 2:
        sys.exit(__doc__)
    strandlight, folder = os.path.abspath(words[0]), os.path.abspath(words[1])
    share = 0.25 if "--quick" in sys.argv else 1.0
    os.makedirs(folder, exist_ok=True)
    if "--costs" in sys.argv:
        for scene in SCENES:
            timed(scene.name, lambda: only_costs(strandlight, folder, scene, share))
        return end(os.path.join(folder, "truth.json"))
    timed("the fibre", lambda: check_probe(strandlight, check))
    timed("its draws", lambda: check_itself(fibre_of(SCENES[1].hair), check))
    for scene in SCENES:
        timed(scene.name, lambda: check_scene(strandlight, folder, scene, share))
    timed("model energy", lambda: check_energy(strandlight, folder, SCENES[1], share))
    return end(os.path.join(folder, "truth.json"))


if __name__ == "__main__":
    sys.exit(main())
