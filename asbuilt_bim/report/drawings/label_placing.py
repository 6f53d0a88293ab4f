"""Puts labels where they don't cover one another."""

import numpy as np

Box = tuple[float, float, float, float]  # left, top, width, height


def free_box(
    centre: tuple[float, float], width: float, height: float, bounds: tuple[float, float], taken: list[Box]
) -> Box:
    """Return the box of `width` x `height` nearest to `centre` that covers the least of `taken`, and enter it there.

    It stays within (0, 0) .. `bounds`; where nothing is free, it covers as little as can be.
    """
    steps = [(dx * width * 0.55, dy * height * 0.55) for dx in range(-4, 5) for dy in range(-10, 11)]
    tries = np.array(sorted(steps, key=lambda step: step[0] ** 2 + step[1] ** 2))
    left = np.clip(centre[0] - width / 2 + tries[:, 0], 1.0, max(bounds[0] - width - 1.0, 1.0))
    top = np.clip(centre[1] - height / 2 + tries[:, 1], 1.0, max(bounds[1] - height - 1.0, 1.0))
    covered = np.zeros(len(tries))
    for x, y, w, h in taken:
        across = np.minimum(left + width, x + w) - np.maximum(left, x)
        down = np.minimum(top + height, y + h) - np.maximum(top, y)
        covered += np.clip(across, 0, None) * np.clip(down, 0, None)
    best = int(np.argmin(covered))  # the first, hence nearest, of the freest
    box = (float(left[best]), float(top[best]), width, height)
    taken.append(box)
    return box
