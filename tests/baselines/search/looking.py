"""What is seen of small known scenes."""

from mpmworlds.baselines.search.guess import look
from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.perception.pixels import Pixels
from mpmworlds.baselines.search.side import Told
from tests.baselines.search.worlds import COLORS, FRAME, prefix_of, world

PIXELS = Pixels.of(256, 512)


def sight_of(scene, told=None):
    """A scene as its prefix shows it, and what is told of it."""
    return look(labels_of(prefix_of(scene)), PIXELS, FRAME, told or Told(), seed=0)


def seen(*names, **options):
    """Scene of some things, and each of them as it is seen."""
    scene = world(*names, **options)
    sight = sight_of(scene)
    found = {t.track.color: t for t in sight.things}
    return scene, sight, [found[COLORS[k]] for k in range(len(names))]
