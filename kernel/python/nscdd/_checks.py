"""Arguments as the kernel takes them. What is wrong is a ValueError of one line, which begins with the name of the thing."""
from __future__ import annotations

import os
from numbers import Integral
from typing import Any, Optional, Union

import numpy as np

Path = Union[str, "os.PathLike[str]"]


def found(value: Any) -> str:
    """The value for a message: itself where it is short, else its class."""
    return repr(value)[:60] if value is None or isinstance(value, (str, int, float, np.number)) else f"a {type(value).__name__}"


def instance(place: str, value: Any, kinds: Any, told: str) -> Any:
    """The value, where it is of one of these classes."""
    if not isinstance(value, kinds):
        raise ValueError(f"{place} must be {told}, found {found(value)}")
    return value


def path(value: Path) -> str:
    """The name of a file."""
    name = os.fsdecode(instance("a file", value, (str, bytes, os.PathLike), "given by its name"))
    if "\0" in name or any("\ud800" <= letter <= "\udfff" for letter in name):
        raise ValueError(f"a file: {name!a} is not a name in UTF-8")
    return name


def single(value: Any) -> bool:
    """Whether it is one value, not a list or an array of some."""
    try:
        return np.ndim(value) == 0
    except ValueError:  # lists of several lengths
        return False


def integer(place: str, value: Any, least: int, most: float = 2**31 - 1) -> int:
    """One whole number."""
    value = value.item() if isinstance(value, (np.ndarray, np.generic)) and value.ndim == 0 else value
    if isinstance(value, bool) or not isinstance(value, Integral) or not least <= value <= most:
        raise ValueError(f"{place} must be a whole number in [{least}, {most}], found {found(value)}")
    return int(value)


def array(place: str, values: Any, shape: Optional[tuple], finite: bool = True, positive: bool = False) -> np.ndarray:
    """As float64 of the shape, in which None is any number (shape None: of any); finite and > 0, where asked."""
    try:
        given = np.asarray(values)
    except ValueError:  # lists of several lengths
        given = np.empty(0, dtype=object)
    if np.ma.is_masked(values):
        raise ValueError(f"{place} must be numbers, some are masked")
    if given.dtype.kind not in "iuf":
        told = "real" if given.dtype.kind == "c" else "a number" if shape == (1,) else "numbers"
        raise ValueError(f"{place} must be {told}, found {found(values)}")
    numbers = np.ascontiguousarray(given, dtype=np.float64)
    if shape is not None and (numbers.ndim != len(shape) or any(want not in (None, has) for want, has in zip(shape, numbers.shape))):
        told = str(tuple("n" if want is None else want for want in shape)).replace("'", "")
        raise ValueError(f"{place} must have shape {told}, found {given.shape}")
    if finite:
        require(place, np.isfinite(given), "finite", given)
    if positive:
        require(place, given > 0, "> 0", given)
    return numbers


def require(place: str, good: Any, told: str, values: np.ndarray) -> None:
    """That all rows are good."""
    if not np.all(good):
        where = tuple(np.argwhere(np.logical_not(good))[0])
        row = f": row {where[0]}" if where else ""
        raise ValueError(f"{place.rstrip(':')}{row} must be {told}, found {values[where]}")


def number(place: str, value: Any, finite: bool = True, positive: bool = False) -> float:
    """One number."""
    return float(array(place, value, (1,), finite, positive)[0])


def points(place: str, values: Any, least: int = 0, finite: bool = True) -> np.ndarray:
    """(n, 2) or (n, 3) numbers, of at least so many points."""
    numbers = array(place, values, None, finite)
    if numbers.ndim != 2 or numbers.shape[1] not in (2, 3) or len(numbers) < least:
        raise ValueError(f"{place} must have shape (n, 2) or (n, 3){', n > 0' if least else ''}, found {numbers.shape}")
    return numbers


def unit(place: str, vectors: np.ndarray) -> np.ndarray:
    """Vectors of length 1; those that single precision has rounded are made so."""
    length = np.linalg.norm(vectors, axis=-1)
    require(place, np.abs(length - 1) <= 1e-6, "of length 1", vectors)
    return np.where(np.abs(length - 1)[..., None] > 1e-12, vectors / length[..., None], vectors)


def whole(place: str, values: Any, shape: tuple) -> np.ndarray:
    """As int32 of the shape; floats may be whole too."""
    if isinstance(values, np.ndarray) and values.dtype.kind == "b":
        values = values.astype(np.int32)
    numbers = array(place, values, shape)
    require(place, (numbers == np.rint(numbers)) & (np.abs(numbers) < 2**31), "a whole number of 32 bits", np.asarray(values))
    return numbers.astype(np.int32)


def axes(place: str, value: Any, dim: int) -> str:
    """Names of axes, such as "xy"."""
    known = "xyz"[:dim]
    if not isinstance(value, str) or set(value) - set(known) or len(set(value)) < len(value):
        raise ValueError(f"{place} must be some of '{known}', found {found(value)}")
    return value
