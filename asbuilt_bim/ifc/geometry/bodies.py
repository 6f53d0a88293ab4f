"""Bodies of IFC products as meshes in world metres, by ifcopenshell's geometry kernel."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import ifcopenshell.geom
import ifcopenshell.guid
import numpy as np

from asbuilt_bim.bim.mesh import Mesh, welded
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import apply

ANGLE_RAD = 0.1
"""Facets of a round column turn by at most this: its volume is then 0.2 % short at most."""
SEGMENTS = int(np.ceil(2.0 * np.pi / ANGLE_RAD))
"""The same for the kernel that counts segments instead."""
MAX_REACH_M = 1e10
"""Beyond it a float has no tenth of a millimetre left: no place on earth, and no body to weld."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """A product's mesh in world metres, and its placement `world_from_local` (4, 4)."""

    mesh: Mesh
    world_from_local: FloatArray


def read_bodies(
    file: Any,
    products: Sequence[Any],
    length_scale: float,
    *,
    world_from_file: FloatArray | None = None,
    threads: int = 1,
    uncut: bool = False,
) -> dict[int, Body]:
    """Return the bodies of products by entity number, openings taken off; those without a usable body are left out.

    `length_scale` is metres per unit of the file: the kernel overlooks the unit of some files, and is corrected then.
    `world_from_file` (4, 4) moves them all, where the file is one of several. `uncut` leaves openings and clippings
    on, and then draws up to ten times as fast.
    """
    drawn = [product for product in products if getattr(product, "Representation", None)]
    if not drawn:
        return {}
    with _all_named(file):
        return _drawn(file, drawn, length_scale, world_from_file, threads, uncut)


@contextmanager
def _all_named(file: Any) -> Iterator[None]:
    """Give what lacks a GlobalId one for a while: IfcOpenShell 0.9.0.post1 draws nothing more once it meets one."""
    nameless = [one for one in file.by_type("IfcObjectDefinition") if one.GlobalId is None]
    for one in nameless:
        one.GlobalId = ifcopenshell.guid.new()
    try:
        yield
    finally:
        for one in nameless:
            one.GlobalId = None


def _drawn(
    file: Any,
    drawn: list[Any],
    length_scale: float,
    world_from_file: FloatArray | None,
    threads: int,
    uncut: bool,
) -> dict[int, Body]:
    settings = ifcopenshell.geom.settings()  # type: ignore[no-untyped-call]
    settings.set("mesher-angular-deflection", ANGLE_RAD)
    settings.set("circle-segments", SEGMENTS)
    settings.set("disable-opening-subtractions", uncut)
    settings.set("disable-boolean-result", uncut)
    kernel: Any = "hybrid-cgal-simple-opencascade" if uncut else "opencascade"
    iterator = ifcopenshell.geom.iterator(settings, file, threads, include=drawn, geometry_library=kernel)
    bodies: dict[int, Body] = {}
    if not iterator.initialize():
        return bodies
    mend = length_scale / float(iterator.unit_magnitude())  # type: ignore[no-untyped-call]
    while True:
        shape = iterator.get()  # type: ignore[no-untyped-call]
        body = _body(shape, mend, world_from_file)
        if body is not None:
            bodies[int(shape.id)] = body
        if not iterator.next():
            return bodies


def _body(shape: Any, mend: float, world_from_file: FloatArray | None) -> Body | None:
    vertices = np.frombuffer(shape.geometry.verts_buffer, dtype=np.float64).reshape(-1, 3) * mend
    triangles = np.frombuffer(shape.geometry.faces_buffer, dtype=np.int32).reshape(-1, 3)
    world_from_local = np.array(shape.transformation.matrix, dtype=np.float64).reshape(4, 4, order="F").copy()
    world_from_local[:3, 3] *= mend
    if world_from_file is not None:
        world_from_local = world_from_file @ world_from_local
    if len(triangles) == 0 or not (np.abs(vertices) <= MAX_REACH_M).all() or not np.isfinite(world_from_local).all():
        return None
    mesh = welded(Mesh(vertices_m=vertices, triangles=triangles))
    if len(mesh.triangles) == 0:
        return None
    world = Mesh(vertices_m=apply(world_from_local, mesh.vertices_m), triangles=mesh.triangles)
    return Body(mesh=world, world_from_local=world_from_local)
