"""Know from photographs what has been built: as-built areas and progress of concrete walls and columns, in BIM/IFC."""

from asbuilt_bim.version import __version__

__all__ = ["__version__"]
