"""The kinds of light. Lengths are in the scene's unit; sizes are radii and half axes."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional, Sequence, Tuple, Union

from . import _abi, _buffers
from ._errors import ArgumentError

Vector = Sequence[float]  # 3 numbers: tuple, list, numpy array, mathutils.Vector, ...


def _fill(field: Any, value: Any, name: str) -> None:
    field[:] = _buffers.reals(value, name, 3)


class _Light:
    """What the kinds have in common: how they become the library's struct."""

    def _begin(self, kind: str, profile: Any = None) -> Tuple[Any, Optional[_buffers.Held]]:
        light = _abi.sized(_abi.softshadow_light)
        light.type = _abi.LIGHTS.index(kind)
        if profile is None:
            return light, None
        held = _buffers.hold(profile, "light.profile", 1, ("float32",), packed=True)
        light.profile = held.address
        light.profile_count = _buffers.whole(held.count, "light.profile")
        return light, held

    def _struct(self) -> Tuple[Any, Optional[_buffers.Held]]:
        raise NotImplementedError


@dataclass(frozen=True)
class Sphere(_Light):
    """A ball. A point at distance d sees a disk of radius r d / sqrt(d^2 - r^2) that faces it.

    position  3 numbers: the centre
    radius    length; 0 is a point light
    profile   weights of the disk's area at rho = i / (len - 1) of its radius; None: uniform
    """

    position: Vector
    radius: float
    profile: Any = None

    def _struct(self) -> Tuple[Any, Optional[_buffers.Held]]:
        light, held = self._begin("sphere", self.profile)
        _fill(light.position, self.position, "light.position")
        light.radius = _buffers.real(self.radius, "light.radius")
        return light, held


@dataclass(frozen=True)
class Disk(_Light):
    """A flat disk, seen from both sides (under irradiance: from its normal's side).

    position  3 numbers: the centre
    normal    3 numbers, any length but 0
    radius    length; 0 is a point light
    profile   weights of the area at rho = i / (len - 1) of the radius; None: uniform
    """

    position: Vector
    normal: Vector
    radius: float
    profile: Any = None

    def _struct(self) -> Tuple[Any, Optional[_buffers.Held]]:
        light, held = self._begin("disk", self.profile)
        _fill(light.position, self.position, "light.position")
        _fill(light.direction, self.normal, "light.normal")
        light.radius = _buffers.real(self.radius, "light.radius")
        return light, held


@dataclass(frozen=True)
class Ellipse(_Light):
    """A flat ellipse, seen from both sides (under irradiance: from the side of u x v).

    position  3 numbers: the centre
    u, v      3 numbers each: HALF axes, perpendicular
    profile   weights of the area at rho = i / (len - 1) of the way to the rim; None: uniform
    """

    position: Vector
    u: Vector
    v: Vector
    profile: Any = None

    def _struct(self) -> Tuple[Any, Optional[_buffers.Held]]:
        light, held = self._begin("disk", self.profile)
        _fill(light.position, self.position, "light.position")
        _fill(light.u, self.u, "light.u")
        _fill(light.v, self.v, "light.v")
        return light, held


@dataclass(frozen=True)
class Rect(_Light):
    """A flat rectangle, seen from both sides (under irradiance: from the side of u x v).

    position  3 numbers: the centre
    u, v      3 numbers each: HALF axes, perpendicular; the rectangle is position +-u +-v
    """

    position: Vector
    u: Vector
    v: Vector

    def _struct(self) -> Tuple[Any, Optional[_buffers.Held]]:
        light, held = self._begin("rect")
        _fill(light.position, self.position, "light.position")
        _fill(light.u, self.u, "light.u")
        _fill(light.v, self.v, "light.v")
        return light, held


@dataclass(frozen=True)
class Sun(_Light):
    """A disk infinitely far away.

    direction  3 numbers, any length but 0: the way light travels, from the sun to the scene
    angle      angular RADIUS in radians, up to 80 degrees; the real sun's is 0.00465
    profile    weights of the disk's area at rho = i / (len - 1) of its radius; None: uniform
    """

    direction: Vector
    angle: float
    profile: Any = None

    def _struct(self) -> Tuple[Any, Optional[_buffers.Held]]:
        light, held = self._begin("sun", self.profile)
        _fill(light.direction, self.direction, "light.direction")
        light.radius = _buffers.real(self.angle, "light.angle")
        return light, held


Light = Union[Sphere, Disk, Ellipse, Rect, Sun]


def struct_of(light: Any) -> Tuple[Any, Optional[_buffers.Held]]:
    """The library's struct, and what must be kept while it is read."""
    if not isinstance(light, _Light):
        raise ArgumentError("light: %r, must be a Sphere, Disk, Ellipse, Rect or Sun" % (light,))
    return light._struct()
