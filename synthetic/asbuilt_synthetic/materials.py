"""What every surface of a scene looks like, as plain numbers that both renderers read.

Colours are sRGB 0..255 as a photo under neutral light would show them; lengths are metres on the
surface. Contrasts are relative: 0.1 means that the pattern changes the base albedo by +-10 %. A
renderer draws as much of it as it can: the ray caster by value noise, Cycles by node trees.
"""

from __future__ import annotations

from dataclasses import dataclass

Srgb = tuple[int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Formwork:
    """The prints that formwork leaves on cast concrete: panels (width, height), joints and tie holes."""

    panel_m: tuple[float, float]
    joint_m: float
    tie_spacing_m: tuple[float, float]
    tie_radius_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Courses:
    """Masonry courses: brick (length, height) in the face, and the joint between."""

    brick_m: tuple[float, float]
    mortar_m: float
    mortar_srgb: Srgb


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """One surface: colours, gloss and the pattern on it.

    `kind` chooses the pattern: "concrete", "wood", "ply", "steel", "rust", "ground", "masonry",
    "painted", "cloth", "leaves", "glass". `second_srgb` is the colour that stains, veins, rust or
    stones of other colour tend to. `grain_m` is the size of the finest grain, `mottle_m` that of the
    large stains. `pore_radius_m` 0 means no pores.
    """

    kind: str
    base_srgb: Srgb
    second_srgb: Srgb
    roughness: float = 0.9
    metallic: float = 0.0
    grain_m: float = 0.004
    grain_contrast: float = 0.08
    mottle_m: float = 0.5
    mottle_contrast: float = 0.08
    bump_m: float = 0.0
    pore_radius_m: float = 0.0
    pore_share: float = 0.0
    formwork: Formwork | None = None
    courses: Courses | None = None


_WALL_FORMWORK = Formwork(panel_m=(1.35, 2.70), joint_m=0.004, tie_spacing_m=(0.675, 1.10), tie_radius_m=0.012)

MATERIALS: dict[str, Material] = {
    "concrete": Material(
        kind="concrete",
        base_srgb=(170, 167, 161),
        second_srgb=(126, 122, 116),
        roughness=0.82,
        grain_m=0.004,
        grain_contrast=0.15,
        mottle_m=0.45,
        mottle_contrast=0.14,
        bump_m=0.0012,
        pore_radius_m=0.004,
        pore_share=0.35,
        formwork=_WALL_FORMWORK,
    ),
    "concrete_slab": Material(
        kind="concrete",
        base_srgb=(157, 154, 147),
        second_srgb=(108, 103, 95),
        roughness=0.88,
        grain_m=0.006,
        grain_contrast=0.16,
        mottle_m=0.8,
        mottle_contrast=0.20,
        bump_m=0.0025,
        pore_radius_m=0.003,
        pore_share=0.15,
    ),
    "concrete_fair": Material(
        kind="concrete",
        base_srgb=(186, 184, 180),
        second_srgb=(152, 149, 145),
        roughness=0.7,
        grain_m=0.003,
        grain_contrast=0.06,
        mottle_m=0.35,
        mottle_contrast=0.07,
        bump_m=0.0004,
        pore_radius_m=0.003,
        pore_share=0.1,
        formwork=_WALL_FORMWORK,
    ),
    "concrete_dark": Material(
        kind="concrete",
        base_srgb=(116, 113, 108),
        second_srgb=(84, 80, 76),
        roughness=0.88,
        grain_m=0.005,
        grain_contrast=0.12,
        mottle_m=0.6,
        mottle_contrast=0.12,
        bump_m=0.0015,
        pore_radius_m=0.004,
        pore_share=0.3,
    ),
    "formwork_ply": Material(
        kind="ply",
        base_srgb=(176, 128, 66),
        second_srgb=(119, 76, 38),
        roughness=0.55,
        grain_m=0.003,
        grain_contrast=0.12,
        mottle_m=0.35,
        mottle_contrast=0.16,
        bump_m=0.0004,
    ),
    "formwork_steel": Material(
        kind="steel",
        base_srgb=(196, 152, 38),
        second_srgb=(128, 118, 104),
        roughness=0.5,
        metallic=0.0,
        grain_m=0.004,
        grain_contrast=0.08,
        mottle_m=0.25,
        mottle_contrast=0.22,
        bump_m=0.0003,
    ),
    "timber": Material(
        kind="wood",
        base_srgb=(190, 152, 103),
        second_srgb=(134, 97, 58),
        roughness=0.75,
        grain_m=0.003,
        grain_contrast=0.16,
        mottle_m=0.4,
        mottle_contrast=0.12,
        bump_m=0.0006,
    ),
    "rebar": Material(
        kind="rust",
        base_srgb=(112, 76, 56),
        second_srgb=(66, 56, 52),
        roughness=0.8,
        metallic=0.15,
        grain_m=0.003,
        grain_contrast=0.22,
        mottle_m=0.15,
        mottle_contrast=0.25,
    ),
    "scaffold_steel": Material(
        kind="steel",
        base_srgb=(158, 161, 163),
        second_srgb=(112, 110, 107),
        roughness=0.42,
        metallic=0.6,
        grain_m=0.004,
        grain_contrast=0.10,
        mottle_m=0.12,
        mottle_contrast=0.18,
    ),
    "ground": Material(
        kind="ground",
        base_srgb=(142, 126, 104),
        second_srgb=(96, 84, 68),
        roughness=0.97,
        grain_m=0.008,
        grain_contrast=0.26,
        mottle_m=1.6,
        mottle_contrast=0.22,
        bump_m=0.012,
    ),
    "plaster": Material(
        kind="painted",
        base_srgb=(214, 206, 186),
        second_srgb=(192, 182, 162),
        roughness=0.9,
        grain_m=0.006,
        grain_contrast=0.08,
        mottle_m=1.2,
        mottle_contrast=0.06,
        bump_m=0.002,
    ),
    "hoarding": Material(
        kind="wood",
        base_srgb=(150, 156, 158),
        second_srgb=(116, 122, 124),
        roughness=0.7,
        grain_m=0.006,
        grain_contrast=0.10,
        mottle_m=0.9,
        mottle_contrast=0.14,
        bump_m=0.001,
    ),
    "brick": Material(
        kind="masonry",
        base_srgb=(168, 124, 105),
        second_srgb=(128, 90, 76),
        roughness=0.92,
        grain_m=0.008,
        grain_contrast=0.14,
        mottle_m=0.9,
        mottle_contrast=0.12,
        bump_m=0.004,
        courses=Courses(brick_m=(0.24, 0.083), mortar_m=0.011, mortar_srgb=(176, 168, 154)),
    ),
    "skin": Material(
        kind="cloth",
        base_srgb=(198, 150, 124),
        second_srgb=(168, 116, 92),
        roughness=0.6,
        grain_m=0.006,
        grain_contrast=0.04,
        mottle_m=0.08,
        mottle_contrast=0.08,
    ),
    "cloth_blue": Material(
        kind="cloth",
        base_srgb=(44, 58, 92),
        second_srgb=(30, 38, 62),
        roughness=0.95,
        grain_m=0.004,
        grain_contrast=0.14,
        mottle_m=0.10,
        mottle_contrast=0.25,
        bump_m=0.006,
    ),
    "cloth_orange_vest": Material(
        kind="cloth",
        base_srgb=(240, 112, 30),
        second_srgb=(206, 88, 22),
        roughness=0.85,
        grain_m=0.004,
        grain_contrast=0.08,
        mottle_m=0.12,
        mottle_contrast=0.18,
        bump_m=0.005,
    ),
    "red_paint": Material(
        kind="painted",
        base_srgb=(178, 30, 30),
        second_srgb=(150, 34, 30),
        roughness=0.45,
        grain_m=0.004,
        grain_contrast=0.05,
        mottle_m=0.15,
        mottle_contrast=0.07,
    ),
    "helmet_white": Material(
        kind="painted",
        base_srgb=(232, 232, 228),
        second_srgb=(200, 198, 190),
        roughness=0.35,
        grain_m=0.004,
        grain_contrast=0.03,
        mottle_m=0.06,
        mottle_contrast=0.06,
    ),
    "tarpaulin": Material(
        kind="cloth",
        base_srgb=(52, 104, 118),
        second_srgb=(36, 78, 92),
        roughness=0.55,
        grain_m=0.005,
        grain_contrast=0.08,
        mottle_m=0.20,
        mottle_contrast=0.22,
        bump_m=0.012,
    ),
    "stand_black": Material(
        kind="painted",
        base_srgb=(42, 42, 44),
        second_srgb=(62, 60, 58),
        roughness=0.5,
        grain_m=0.003,
        grain_contrast=0.08,
        mottle_m=0.10,
        mottle_contrast=0.12,
    ),
    "grass": Material(
        kind="ground",
        base_srgb=(96, 112, 56),
        second_srgb=(126, 112, 70),
        roughness=0.98,
        grain_m=0.012,
        grain_contrast=0.34,
        mottle_m=0.9,
        mottle_contrast=0.24,
        bump_m=0.02,
    ),
    "foliage": Material(
        kind="leaves",
        base_srgb=(92, 112, 58),
        second_srgb=(58, 76, 36),
        roughness=0.8,
        grain_m=0.05,
        grain_contrast=0.45,
        mottle_m=0.5,
        mottle_contrast=0.30,
        bump_m=0.04,
    ),
    "glass": Material(
        kind="glass",
        base_srgb=(52, 62, 70),
        second_srgb=(96, 110, 120),
        roughness=0.12,
        grain_m=0.05,
        grain_contrast=0.02,
        mottle_m=1.2,
        mottle_contrast=0.30,
    ),
}


def linear_rgb(srgb: Srgb) -> tuple[float, float, float]:
    """Turn 8-bit sRGB into linear RGB 0..1 (IEC 61966-2-1)."""

    def one(value: int) -> float:
        c = value / 255.0
        return c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4

    r, g, b = srgb
    return one(r), one(g), one(b)
