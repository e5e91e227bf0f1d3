"""Small environment maps for tests of farms: a sky, a ground and a few lamps, by a seed."""

import math
import os
import random


def rgbe(rgb):
    largest = max(rgb)
    if largest < 1e-32:
        return bytes(4)
    fraction, exponent = math.frexp(largest)
    scale = fraction * 256 / largest
    return bytes([*(int(x * scale) for x in rgb), exponent + 128])


def write(path, seed, width=128, height=64):
    """Writes a Radiance map; the same seed gives the same bytes."""
    rng = random.Random(seed)
    sky = [rng.uniform(0.1, 1.0) for _ in range(3)]
    lamps = []
    for _ in range(rng.randint(2, 5)):
        theta, phi = math.acos(rng.uniform(-0.5, 1)), rng.uniform(0, 2 * math.pi)
        direction = (math.sin(theta) * math.cos(phi), math.cos(theta), math.sin(theta) * math.sin(phi))
        lamps.append((direction, rng.uniform(5, 200), [rng.uniform(1, 20) for _ in range(3)]))
    pixels = bytearray()
    for row in range(height):
        theta = math.pi * (row + 0.5) / height
        for column in range(width):
            phi = 2 * math.pi * (column + 0.5) / width
            d = (math.sin(theta) * math.cos(phi), math.cos(theta), math.sin(theta) * math.sin(phi))
            rgb = [x * max(0.05, d[1]) for x in sky]
            for axis, sharpness, colour in lamps:
                amount = math.exp(sharpness * (sum(a * b for a, b in zip(axis, d)) - 1))
                rgb = [x + amount * y for x, y in zip(rgb, colour)]
            pixels += rgbe(rgb)
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode()
    with open(path, "wb") as file:
        file.write(header + pixels)


def make(folder, count, **size):
    """Writes count maps into the folder."""
    os.makedirs(folder, exist_ok=True)
    for seed in range(count):
        write(os.path.join(folder, f"map{seed:04}.hdr"), seed, **size)
