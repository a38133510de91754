"""The program built for other processors and by other compilers; builds stay in build-bits/."""
import os
import subprocess

from ...program import ROOT

HERE = ROOT / "build-bits"
BUILDS = {
    "g++-v3": ("g++", "-march=x86-64-v3"),
    "g++-v4": ("g++", "-march=x86-64-v4"),
    "clang-v3": ("clang++-16", "-march=x86-64-v3"),
    "aarch64": ("aarch64-linux-gnu-g++", ""),
}
ARM_PACKAGES = (
    "libhdf5-dev libopenmpi-dev libsuitesparse-dev libmetis-dev libfmt-dev libtomlplusplus-dev libstdc++-12-dev libeigen3-dev "
    "nlohmann-json3-dev libcli11-dev"
).split()


def arm_root():
    """Debian's libraries for aarch64, unpacked."""
    root, apt = HERE / "aarch64-root", HERE / "apt"
    done = root / "done"
    if done.exists():
        return root
    for folder in ("lists/partial", "cache/archives/partial"):
        (apt / folder).mkdir(parents=True, exist_ok=True)
    options = [
        f"-o{key}={value}"
        for key, value in {
            "APT::Architecture": "arm64",
            "APT::Architectures": "arm64",
            "Dir::State::Lists": apt / "lists",
            "Dir::Cache": apt / "cache",
            "Dir::State::status": "/dev/null",
            "Debug::NoLocking": 1,
        }.items()
    ]
    subprocess.run(["apt-get", "-q", *options, "update"], check=True)
    subprocess.run(["apt-get", "-qy", *options, "--no-install-recommends", "--download-only", "install", *ARM_PACKAGES], check=True)
    for package in sorted((apt / "cache/archives").glob("*.deb")):
        subprocess.run(["dpkg", "-x", package, root], check=True)
    for library in ("blas", "lapack"):  # links that dpkg's alternatives would make
        link = root / f"usr/lib/aarch64-linux-gnu/lib{library}.so.3"
        link.unlink(missing_ok=True)
        link.symlink_to(f"{library}/lib{library}.so.3")
    done.touch()
    return root


def arm_options(folder):
    root = arm_root()
    libraries = root / "usr/lib/aarch64-linux-gnu"
    (folder / "toolchain.cmake").write_text(
        f"""set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_SYSROOT {root})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
foreach(kind LIBRARY INCLUDE PACKAGE)
    set(CMAKE_FIND_ROOT_PATH_MODE_${{kind}} ONLY)
endforeach()
"""
    )
    return [
        f"-DCMAKE_TOOLCHAIN_FILE={folder}/toolchain.cmake",
        f"-DHDF5_C_LIBRARY_hdf5={libraries}/hdf5/serial/libhdf5.so",
        f"-DHDF5_INCLUDE_DIRS={root}/usr/include/hdf5/serial",
        f"-DMPI_CXX_HEADER_DIR={libraries}/openmpi/include",
        "-DMPI_CXX_LIB_NAMES=mpi_cxx;mpi",
        f"-DMPI_mpi_LIBRARY={libraries}/openmpi/lib/libmpi.so",
        f"-DMPI_mpi_cxx_LIBRARY={libraries}/openmpi/lib/libmpi_cxx.so",
    ]


def build(name):
    """Path of a program that this machine can start."""
    compiler, flags = BUILDS[name]
    folder = HERE / name
    folder.mkdir(parents=True, exist_ok=True)
    more = arm_options(folder) if name == "aarch64" else []
    subprocess.run(
        [
            "cmake",
            "-G",
            "Ninja",
            "-S",
            ROOT,
            "-B",
            folder,
            "-DCMAKE_BUILD_TYPE=Release",
            "-DNSCDD_NATIVE=OFF",
            "-DNSCDD_TESTS=OFF",
            f"-DCMAKE_CXX_COMPILER={compiler}",
            f"-DCMAKE_CXX_FLAGS={flags}",
            *more,
        ],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    subprocess.run(["cmake", "--build", folder, "-j", str(os.cpu_count()), "--target", "nscdd"], check=True, stdout=subprocess.DEVNULL)
    program = folder / "bin/nscdd"
    if name != "aarch64":
        return program
    starter = folder / "nscdd"
    starter.write_text(f'#!/bin/sh\nexec qemu-aarch64 -L {HERE}/aarch64-root {program} "$@"\n')
    starter.chmod(0o755)
    return starter
