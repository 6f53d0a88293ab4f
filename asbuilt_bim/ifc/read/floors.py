"""The floors of a design: every slab of its files, openings taken off, in the world of the first file."""

from collections.abc import Sequence
from pathlib import Path

from asbuilt_bim.bim.model import Obstacle
from asbuilt_bim.geometry.arrays import freeze, frozen
from asbuilt_bim.ifc.geometry.bodies import read_bodies
from asbuilt_bim.ifc.read.federation import Member, member
from asbuilt_bim.ifc.read.source import open_ifc


def read_floors(paths: Sequence[Path | str]) -> tuple[Obstacle, ...]:
    """Read the slabs; one without a body is left out.

    Raises:
        DesignError: a file is missing, no IFC, cut short or of another schema.
    """
    found: list[Obstacle] = []
    first: Member | None = None
    for path in paths:
        file = open_ifc(Path(path))
        one = member(Path(path), file, first)
        first = first or one
        slabs = file.by_type("IfcSlab")
        bodies = read_bodies(file, slabs, one.units.length_scale, world_from_file=one.world_from_file)
        for slab in slabs:
            if (body := bodies.get(slab.id())) is not None:
                mesh = body.mesh
                found.append(
                    Obstacle(
                        global_id=slab.GlobalId or "",
                        ifc_class=slab.is_a(),
                        vertices_m=frozen(mesh.vertices_m),
                        triangles=freeze(mesh.triangles),
                    )
                )
    return tuple(found)
