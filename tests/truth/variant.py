"""Mitsuba's variant of these checks, chosen before anything of Mitsuba is imported.

`llvm_ad_rgb` compiles what Python describes, so a scattering function written in Python is traced at the
speed of compiled code. It loads LLVM at run time: `tests/run` installs version 19, because 15, which Debian
12 has by default, ends the process on processors with AVX-512 ("Cannot select: fmaximum").
"""

import glob
import os

LIBRARIES = [
    "/usr/lib/*-linux-gnu/libLLVM.so.19.1",
    "/usr/lib/*-linux-gnu/libLLVM-19.so*",
    "/usr/lib64/libLLVM.so.19*",
]

if "DRJIT_LIBLLVM_PATH" not in os.environ:
    found = [path for pattern in LIBRARIES for path in sorted(glob.glob(pattern))]
    if found:
        os.environ["DRJIT_LIBLLVM_PATH"] = found[0]

import mitsuba as mi  # noqa: E402

mi.set_variant("llvm_ad_rgb")
