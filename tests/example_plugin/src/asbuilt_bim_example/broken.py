"""A plugin whose import fails, as one made for another version does."""

from asbuilt_bim.no_such_module import Writer  # type: ignore[import-not-found]  # noqa: F401
