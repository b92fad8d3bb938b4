"""The release, served by a Hub on the loopback interface."""

import pytest

from tests.hub import Hub


@pytest.fixture(scope="session")
def hub(release, tmp_path_factory):
    """Loopback Hub that holds the release as `acme/mpmworlds`, tagged."""
    with Hub(tmp_path_factory.mktemp("hub")) as hub:
        hub.serve(release, "acme/mpmworlds", tag="v1.2.3")
        yield hub
