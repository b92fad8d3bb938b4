"""Edges of bodies tell those of a mesh and rigid ones from particles."""

import numpy as np
import pytest

from mpmworlds.baselines.search.guess import look
from mpmworlds.baselines.search.infer import Budget, infer
from mpmworlds.baselines.search.matter import DRAWN, looks_like, of_matter
from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.perception.edges import Edge, edge_of
from mpmworlds.baselines.search.perception.pixels import Pixels, covered
from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.side import Told
from mpmworlds.baselines.search.trials.moves import Doubt
from mpmworlds.baselines.search.trials.tried import Known, Tried
from mpmworlds.metrics.reduction import reduce_clip
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.objects import MATERIALS
from tests.baselines.search.worlds import FORM, FRAME, checked, world

PIXELS = Pixels.of(256, 512)
ANY = np.ones((256, 256), np.bool_)


def made_of(name, *things):
    data = world(*things).to_data()
    for number, thing in enumerate(data["objects"]):
        data["objects"][number] = of_matter(thing, prior().typical(name), {})
    return checked(data)


def start_of(scene, frames=1):
    return reduce_clip(run(link(scene), 2 * frames, trusted=True).expect(), 30)[:frames]


def seen(frames, told=None):
    return look(labels_of(frames), PIXELS, FRAME, told or Told(), seed=0).things


@pytest.mark.parametrize("name", sorted(MATERIALS))
def test_edges_are_those_of_the_class(name):
    edges = {thing.edge for thing in seen(start_of(made_of(name, "brick", "ball"), 2))}
    right = Edge.SHARP if name in DRAWN else Edge.GRAINY
    # Those of a small mesh are left open: its corners are a little round.
    assert right in edges or name == "elastic_fem"
    assert edges <= {right, Edge.UNCLEAR}


def test_a_polygon_that_is_drawn_larger_is_sharp():
    """Drawn larger all around, an L is no L of other sides."""
    data = world("brick").to_data()
    corners = [
        [-0.1, -0.1],
        [0.1, -0.1],
        [0.1, 0.0],
        [0.0, 0.0],
        [0.0, 0.1],
        [-0.1, 0.1],
    ]
    data["objects"][0]["shape"] = {
        "type": "polygon",
        "center": [0.4, 0.6],
        "angle_deg": 20.0,
        "vertices": corners,
    }
    data["objects"][0]["physics_properties"] = prior().typical("elastic_fem")
    (thing,) = seen(start_of(checked(data), 2))
    assert thing.edge in (Edge.SHARP, Edge.UNCLEAR)


def test_what_hides_a_part_tells_nothing():
    shape = world("brick").to_data()["objects"][0]["shape"]
    mask = covered(shape, PIXELS)
    half = mask.copy()
    half[:, 100:] = False
    assert edge_of(mask, ANY, PIXELS, shape) is Edge.SHARP
    assert edge_of(half, ANY, PIXELS, shape) is Edge.GRAINY
    care = ANY.copy()
    care[:, 100:] = False
    assert edge_of(half, care, PIXELS, shape) is not Edge.GRAINY


def test_edges_of_a_recompressed_clip_are_unclear():
    frames = start_of(made_of("liquid", "brick"), 2).astype(int)
    noise = np.random.default_rng(0).integers(-9, 10, frames.shape)
    noisy = np.clip(frames + noise, 0, 255).astype(np.uint8)
    assert {thing.edge for thing in seen(noisy)} == {Edge.UNCLEAR}


def test_each_class_has_one_kind_of_edge():
    for name in MATERIALS:
        kinds = [looks_like(name, edge) for edge in (Edge.SHARP, Edge.GRAINY)]
        assert sorted(kinds) == [False, True]
        assert looks_like(name, Edge.UNCLEAR)


def test_classes_of_another_edge_are_never_tried():
    data = world("brick", "jet", "ball").to_data()
    doubt = Doubt({}, {}, (), (), walls=False)
    edges = {0: Edge.SHARP, 2: Edge.GRAINY}
    known = Known(doubt, None, {}, (), {}, edges)
    tried = Tried(None, prior(), known)  # nothing is run
    for name in MATERIALS:
        made = tried.of_class(data, [0, 1, 2], name)["objects"]
        of = [thing["physics_properties"]["constitutive_model"] for thing in made]
        assert of[0] == (name if name in DRAWN else "elastic_fem")
        assert of[1:] == ["elastic" if name in DRAWN else name] * 2


def test_a_search_tries_no_class_that_the_edge_excludes():
    frames = start_of(made_of("elastic", "brick"), 8)
    found = infer(frames, 15, FORM, Told(), Budget(runs=14), 1)
    bodies = [trial.data["objects"][0]["physics_properties"] for trial in found.trials]
    tried = [t.data["objects"][0]["physics_properties"] for t in found.search.trials]
    assert bodies and not {p["constitutive_model"] for p in tried} & DRAWN.keys()
