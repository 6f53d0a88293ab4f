"""Gives a design element its faces, and the mesh of what is poured of it, openings cut out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asbuilt_synthetic.building import Element
from asbuilt_synthetic.meshes import Part, circle, prism, transform
from asbuilt_synthetic.model import FloatArray, IntArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Side:
    """One lateral design face in the element's frame: p = origin + u * along + v * z, u in 0..length.

    For a round column u is the arc length and `origin_m` the point where the arc begins.
    """

    name: str
    kind: str  # "plane" | "cylinder"
    origin_m: FloatArray  # (3,)
    along: FloatArray  # (3,) unit
    normal: FloatArray  # (3,) unit, outward
    length_m: float
    height_m: float
    radius_m: float
    x_from_u: tuple[float, float]  # x - x_low = a + b * u: where u lies along the element's length

    def points(self, u_m: FloatArray, v_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return points (N, 3) and outward normals (N, 3) in the element's frame."""
        if self.kind == "cylinder":
            a = u_m / self.radius_m
            n = np.c_[np.cos(a), np.sin(a), np.zeros_like(a)]
            return n * self.radius_m + np.c_[np.zeros((len(a), 2)), v_m], n
        p = self.origin_m + u_m[:, None] * self.along + v_m[:, None] * np.array([0, 0, 1.0])
        return p, np.broadcast_to(self.normal, p.shape)


def sides(e: Element) -> tuple[Side, ...]:
    """List the lateral design faces: side+ (y up), side- (y down), start, end; or the one of a round column."""
    if e.shape == "round":
        r = e.length_m / 2
        return (
            Side(
                name="round",
                kind="cylinder",
                origin_m=np.array([r, 0, 0]),
                along=np.array([0, 1.0, 0]),
                normal=np.array([0, 0, 1.0]),
                length_m=2 * np.pi * r,
                height_m=e.height_m,
                radius_m=r,
                x_from_u=(r, 0.0),
            ),
        )
    (x0, x1), h = e.x_range_m, e.width_m / 2
    rows = [
        ("side+", (x1, h, 0), (-1, 0, 0), (0, 1, 0), x1 - x0, (x1 - x0, -1.0)),
        ("side-", (x0, -h, 0), (1, 0, 0), (0, -1, 0), x1 - x0, (0.0, 1.0)),
        ("start", (x0, h, 0), (0, -1, 0), (-1, 0, 0), 2 * h, (0.0, 0.0)),
        ("end", (x1, -h, 0), (0, 1, 0), (1, 0, 0), 2 * h, (x1 - x0, 0.0)),
    ]
    return tuple(
        Side(
            name=n,
            kind="plane",
            origin_m=np.array(o, float),
            along=np.array(a, float),
            normal=np.array(m, float),
            length_m=length,
            height_m=e.height_m,
            radius_m=0.0,
            x_from_u=x,
        )
        for n, o, a, m, length, x in rows
    )


def side_area_m2(e: Element, side: Side, height_m: float | None = None) -> float:
    """Return the area of a face up to a height (default: all of it), openings off."""
    top = e.height_m if height_m is None else height_m
    area = side.length_m * top
    if side.name.startswith("side"):
        area -= sum(o.width_m * max(0.0, min(top, o.sill_m + o.height_m) - o.sill_m) for o in e.openings)
    return float(area)


def volume_m3(e: Element, height_m: float | None = None) -> float:
    """Return the concrete volume up to a height."""
    top = e.height_m if height_m is None else height_m
    if e.shape == "round":
        return float(np.pi * (e.length_m / 2) ** 2 * top)
    return side_area_m2(e, sides(e)[0], top) * e.width_m


def poured(e: Element, height_m: float, first_face: int, texture_seed: int) -> Part:
    """Mesh what is poured, in the site's local frame; `first_face` is the scene index of the element's face 0."""
    if e.shape == "round":
        part = prism(e.name, circle(e.length_m / 2), 0.0, height_m, "concrete")
        quads = 2 * len(circle(1.0))
        face = np.where(np.arange(len(part.triangles)) < quads, first_face, -1).astype(np.int32)
        vertices, triangles = part.vertices_m, part.triangles
    else:
        vertices, triangles, face = _block(e, height_m)
        face = np.where(face >= 0, face + first_face, -1).astype(np.int32) if e.shape != "slab" else face * 0 - 1
    m = e.local_from_element
    return Part(
        name=e.name,
        vertices_m=transform(m, vertices),
        triangles=triangles,
        face_id=face,
        material="concrete_slab" if e.shape == "slab" else "concrete",
        element=e.global_id,
        texture_seed=texture_seed,
        round_axis_m=m[:3, 3].copy() if e.shape == "round" else None,
    )


def in_opening(e: Element, x_m: FloatArray, z_m: FloatArray) -> np.ndarray:
    """Tell which points (distance from the start, height) lie in an opening."""
    hit = np.zeros(np.broadcast(x_m, z_m).shape, bool)
    for o in e.openings:
        hit |= (x_m > o.start_m) & (x_m < o.start_m + o.width_m) & (z_m > o.sill_m) & (z_m < o.sill_m + o.height_m)
    return hit


def _block(e: Element, height_m: float) -> tuple[FloatArray, IntArray, IntArray]:
    """Cut length x height at the openings' edges and skin every solid piece where its neighbour is not."""
    x0, x1 = e.x_range_m
    xs = np.unique(np.r_[0, x1 - x0, [v for o in e.openings for v in (o.start_m, o.start_m + o.width_m)]])
    cuts = [v for o in e.openings for v in (o.sill_m, o.sill_m + o.height_m) if v < height_m]
    zs = np.unique(np.r_[0, height_m, cuts])
    xc, zc = (xs[1:] + xs[:-1]) / 2, (zs[1:] + zs[:-1]) / 2
    solid = np.pad(~in_opening(e, xc[:, None], zc[None, :]), 1)
    nx, nz, h = len(xs), len(zs), e.width_m / 2
    grid = np.stack(np.meshgrid(xs + x0, [-h, h], zs, indexing="ij"), -1)  # (nx, 2, nz, 3)

    def v(i: int, j: int, k: int) -> int:
        return (i * 2 + j) * nz + k

    quads: list[tuple[int, int, int, int]] = []
    ids: list[int] = []
    for i in range(nx - 1):
        for k in range(nz - 1):
            if not solid[i + 1, k + 1]:
                continue
            a, b, c, d = (i, k), (i + 1, k), (i + 1, k + 1), (i, k + 1)
            quads.append((v(b[0], 1, b[1]), v(a[0], 1, a[1]), v(d[0], 1, d[1]), v(c[0], 1, c[1])))
            quads.append((v(a[0], 0, a[1]), v(b[0], 0, b[1]), v(c[0], 0, c[1]), v(d[0], 0, d[1])))
            ids += [0, 1]
            for (p, q), beyond, outer in (
                ((a, b), (i + 1, k), -1),
                ((b, c), (i + 2, k + 1), 3 if i == nx - 2 else -1),
                ((c, d), (i + 1, k + 2), -1),
                ((d, a), (i, k + 1), 2 if i == 0 else -1),
            ):
                if not solid[beyond]:
                    quads.append((v(p[0], 0, p[1]), v(p[0], 1, p[1]), v(q[0], 1, q[1]), v(q[0], 0, q[1])))
                    ids.append(outer)
    tri = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32)
    return grid.reshape(-1, 3), tri, np.repeat(np.array(ids, np.int32), 2)
