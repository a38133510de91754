"""The program built for other processors and by other compilers; builds stay in build-bits/."""
import os
import subprocess
from pathlib import Path

from ...program import ROOT

HERE = ROOT / "build-bits"
ARM_ROOT = HERE / "aarch64-root"
BUILDS = {
    "g++-v3": ("g++", "-march=x86-64-v3"),
    "g++-v4": ("g++", "-march=x86-64-v4"),
    "clang-v3": ("clang++-16", "-march=x86-64-v3"),
    "aarch64": ("aarch64-linux-gnu-g++", ""),
}
ARM_PACKAGES = (
    "libhdf5-dev libopenmpi-dev libsuitesparse-dev libmetis-dev libfmt-dev libtomlplusplus-dev libstdc++-12-dev libeigen3-dev nlohmann-json3-dev libcli11-dev"
)


def call(*command, **how):
    subprocess.run(list(map(str, command)), check=True, **how)


def unpack_arm_packages():
    """Debian's libraries for aarch64, under ARM_ROOT."""
    apt, done = HERE / "apt", ARM_ROOT / "done"
    if done.exists():
        return
    for folder in ("lists/partial", "cache/archives/partial"):
        (apt / folder).mkdir(parents=True, exist_ok=True)
    places = [f"-oDir::State::Lists={apt}/lists", f"-oDir::Cache={apt}/cache", "-oDir::State::status=/dev/null", "-oDebug::NoLocking=1"]
    options = ["-qy", "-oAPT::Architecture=arm64", "-oAPT::Architectures=arm64", *places]
    call("apt-get", *options, "update")
    call("apt-get", *options, "--no-install-recommends", "--download-only", "install", *ARM_PACKAGES.split())
    for package in sorted((apt / "cache/archives").glob("*.deb")):
        call("dpkg", "-x", package, ARM_ROOT)
    for library in ("blas", "lapack"):  # links that dpkg's alternatives would make
        link = ARM_ROOT / f"usr/lib/aarch64-linux-gnu/lib{library}.so.3"
        link.unlink(missing_ok=True)
        link.symlink_to(f"{library}/lib{library}.so.3")
    done.touch()


def arm_options():
    unpack_arm_packages()
    libraries = ARM_ROOT / "usr/lib/aarch64-linux-gnu"
    return [
        f"-DCMAKE_TOOLCHAIN_FILE={Path(__file__).with_name('aarch64.cmake')}",
        f"-DHDF5_C_LIBRARY_hdf5={libraries}/hdf5/serial/libhdf5.so",
        f"-DHDF5_INCLUDE_DIRS={ARM_ROOT}/usr/include/hdf5/serial",
        f"-DMPI_CXX_HEADER_DIR={libraries}/openmpi/include",
        "-DMPI_CXX_LIB_NAMES=mpi_cxx;mpi",
        *(f"-DMPI_{name}_LIBRARY={libraries}/openmpi/lib/lib{name}.so" for name in ("mpi", "mpi_cxx")),
    ]


def build(name):
    """Path of a program that this machine can start."""
    (compiler, flags), folder, arm = BUILDS[name], HERE / name, name == "aarch64"
    folder.mkdir(parents=True, exist_ok=True)
    options = [
        "-DCMAKE_BUILD_TYPE=Release",
        "-DNSCDD_NATIVE=OFF",
        "-DNSCDD_LEVELS=",
        "-DNSCDD_TESTS=OFF",
        f"-DCMAKE_CXX_COMPILER={compiler}",
        f"-DCMAKE_CXX_FLAGS={flags}",
    ]
    call("cmake", "-G", "Ninja", "-S", ROOT, "-B", folder, *options, *(arm_options() if arm else []), stdout=subprocess.DEVNULL)
    call("cmake", "--build", folder, "-j", os.cpu_count(), "--target", "nscdd", stdout=subprocess.DEVNULL)
    program, starter = folder / "bin/nscdd", folder / "nscdd"
    if not arm:
        return program
    starter.write_text(f'#!/bin/sh\nexec qemu-aarch64 -L {ARM_ROOT} {program} "$@"\n')
    starter.chmod(0o755)
    return starter
