"""The design of a project: read from its IFC files once, then from the cache for as long as they stay as they are."""

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.bim.twins import once_each
from asbuilt_bim.ifc.apart import read_design
from asbuilt_bim.ifc.read.source import files_digest
from asbuilt_bim.project.read import Project
from asbuilt_bim.scale.cache import Cache, digest_of
from asbuilt_bim.scale.fingerprint import library_versions, reading_code_digest


def design_of(project: Project, cache: Cache) -> BimModel:
    """Return what the project's IFC files hold of its scope.

    Raises:
        DesignError: a file can't be used; see `read_design`. What can't be used is never kept.
    """
    key = _key(project) if cache.folder is not None else ""
    found = cache.get(key, BimModel) if key else None
    if found is not None:
        return found
    design = once_each(read_design(project.ifc, project.scope))
    if key and _key(project) == key:  # else a file was written anew in between
        cache.put(key, design, BimModel)
    return design


def _key(project: Project) -> str:
    """Return a digest of all that the design depends on, "" where a file can't be read: `read_design` says why."""
    try:
        digest = files_digest(project.ifc)
    except OSError:
        return ""
    libraries = [f"{name} {version}" for name, version in sorted(library_versions().items())]
    names = [path.name for path in project.ifc]
    return digest_of(["design", digest, project.scope or "", reading_code_digest(), *libraries, *names])
