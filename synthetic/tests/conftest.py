import pytest

from asbuilt_synthetic.model import Scene
from asbuilt_synthetic.scene import scene


@pytest.fixture(scope="session")
def site_scene() -> Scene:
    return scene(3, 1, stations=3, tries=250)
