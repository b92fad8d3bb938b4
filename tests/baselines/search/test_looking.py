"""What is seen of small known scenes is what is there."""

import cv2
import numpy as np
import pytest

from mpmworlds.baselines.search.infer import alone_until
from mpmworlds.baselines.search.perception.colors import MOST_COLORS, labels_of
from mpmworlds.baselines.search.perception.laws import amplitude_of
from mpmworlds.baselines.search.perception.pixels import covered
from mpmworlds.baselines.search.perception.shapes import fit_shape
from mpmworlds.baselines.search.prior import prior
from mpmworlds.sim.scene.objects import SHAPES
from tests.baselines.search.looking import PIXELS, seen, sight_of
from tests.baselines.search.worlds import COLORS, FRAME, checked, prefix_of, world

MOVING = ("still", "wall", "fan", "gate", "bowl", "brick", "ball")
POURED = ("jet", "rain")


@pytest.fixture(scope="module")
def moving():
    return seen(*MOVING, gravity=(1.0, -6.0))


@pytest.fixture(scope="module")
def poured():
    return seen(*POURED)


def test_object_types_are_found(moving, poured):
    for scene, _, things in (moving, poured):
        assert [t.kind for t in things] == [o.object_type for o in scene.objects]


def test_shapes_are_found(moving):
    scene, _, things = moving
    for thing, truth in zip(things, scene.objects, strict=True):
        assert thing.fit.shape["type"] == truth.shape.type
        there = covered(truth.shape.model_dump(mode="json"), PIXELS)
        found = covered(thing.fit.shape, PIXELS)
        assert (there & found).sum() / (there | found).sum() > 0.97, truth.name


def law(things, name):
    thing = things[MOVING.index(name)]
    return thing.laws[0].kinematics


def test_a_rotation_is_measured(moving):
    found = law(moving[2], "fan")
    assert found["type"] == "rotate"
    assert found["angular_velocity"] == pytest.approx(-4.0, rel=0.01)


def test_a_translation_is_measured_with_its_times(moving):
    found = law(moving[2], "gate")
    assert found["type"] == "translate"
    assert found["velocity"] == pytest.approx([0.0, 0.35], abs=0.005)
    assert (found["start"], found["stop"]) == pytest.approx((0.2, 0.6), abs=0.01)


def test_an_oscillation_is_measured_with_its_turn(moving):
    found = law(moving[2], "bowl")
    assert found["type"] == "oscillate"
    sign = np.sign(np.sin(np.radians(found["phase_deg"])))
    assert found["frequency"] == pytest.approx(2.0, rel=0.01)
    assert sign * found["amplitude_deg"] == pytest.approx(20.0, rel=0.05)
    assert sign * np.array(found["amplitude"]) == pytest.approx([0.03, 0.0], abs=0.002)


def test_an_amplitude_is_measured_for_a_phase_that_is_told(moving):
    poses = moving[2][MOVING.index("bowl")].poses
    for phase, sign in ((90.0, 1.0), (-90.0, -1.0)):
        found = amplitude_of(poses, FRAME, 2.0, phase)
        assert found == pytest.approx([sign * 0.03, 0.0], abs=0.002)


def test_gravity_and_velocities_are_read_off_flights(moving):
    _, sight, things = moving
    assert sight.gravities[0].sure
    assert sight.gravities[0].value == pytest.approx((1.0, -6.0), abs=0.25)
    brick = things[MOVING.index("brick")].flight
    assert brick.velocity == pytest.approx((0.3, 0.6), abs=0.05)
    assert brick.spin == pytest.approx(2.0, rel=0.05)
    assert things[MOVING.index("ball")].flight.velocity == (0.0, 0.0)


def test_a_body_that_is_pushed_tells_no_gravity():
    """What bends its way looks like a pull aside."""
    data = world("brick", "bowl").to_data()
    brick, bowl = data["objects"]
    brick["physics_properties"] = prior().typical("snow")
    brick["shape"] |= {"center": [0.5, 0.6], "angle_deg": 0.0}
    brick["initial_state"] = {"velocity": [-1.5, -1.0], "angular_velocity": 0.0}
    bowl["shape"] = {"type": "circle", "center": [0.3, 0.45], "radius": 0.1}
    bowl["kinematics"]["amplitude"] = [0.03, 0.0]
    sight = sight_of(checked(data))
    assert any(g.value == (0.0, -9.8) for g in sight.gravities)
    assert sight.gravities[0].value == (0.0, -9.8) or not sight.gravities[0].sure


def test_what_lies_near_is_pushed_from_the_first_frame_on():
    """Frames in which nothing is near are counted."""
    brick = seen("brick", "ball")[2][0]
    assert brick.poses.clear > 8
    data = world("brick", "ball").to_data()
    data["objects"][0]["shape"]["center"] = [0.455, 0.55]  # beside the ball
    things = sight_of(checked(data)).things
    assert [thing.poses.clear for thing in things] == [0, 0]


@pytest.mark.parametrize(
    "shape",
    [
        {"type": "ellipse", "angle_deg": -110.0, "semi_axes": [0.0521, 0.053]},
        {
            "type": "rounded_box",
            "angle_deg": -3.0,
            "size": [0.088, 0.085],
            "corner_radius": 0.04,
        },
    ],
    ids=lambda shape: shape["type"],
)
def test_what_is_nearly_round_is_a_circle(shape):
    mask = covered(shape | {"center": [0.47, 0.52]}, PIXELS)
    assert fit_shape(mask, PIXELS).shape["type"] == "circle"


def test_a_polygon_behind_something_is_one_of_few_corners():
    corners = [[-0.1, -0.12], [0.1, -0.12], [0.05, 0.12], [-0.05, 0.12]]
    shape = {"type": "polygon", "center": [0.5, 0.5], "vertices": corners}
    mask = covered(shape, PIXELS)
    front = {
        "type": "box",
        "center": [0.5, 0.5],
        "angle_deg": 20.0,
        "size": [0.5, 0.03],
    }
    hidden = covered(front, PIXELS)
    fit = fit_shape(mask & ~hidden, PIXELS, care=~hidden)
    assert (len(fit.shape["vertices"]), fit.iou > 0.99) == (4, True)


@pytest.mark.parametrize("name", SHAPES)
def test_every_shape_is_told_from_the_others(name):
    shape = EXAMPLES[name] | {"type": name, "center": [0.47, 0.52]}
    mask = covered(shape, PIXELS)
    fit = fit_shape(mask, PIXELS)
    assert (fit.shape["type"], fit.iou > 0.98) == (name, True)
    assert PIXELS.centroid(covered(fit.shape, PIXELS)) == pytest.approx(
        PIXELS.centroid(mask), abs=1e-3
    )


EXAMPLES = {
    "box": {"angle_deg": 25.0, "size": [0.2, 0.12]},
    "capsule": {"angle_deg": -40.0, "length": 0.15, "radius": 0.04},
    "circle": {"radius": 0.08},
    "ellipse": {"angle_deg": 70.0, "semi_axes": [0.12, 0.06]},
    "fan_blades": {
        "angle_deg": 12.0,
        "blade_count": 4,
        "blade_length": 0.13,
        "thickness": 0.03,
    },
    "polygon": {"vertices": [[0.0, 0.12], [-0.11, -0.06], [0.11, -0.06]]},
    "ring": {"angle_deg": 30.0, "radius": 0.1, "thickness": 0.03, "opening_deg": 90.0},
    "rounded_box": {"angle_deg": 10.0, "size": [0.2, 0.16], "corner_radius": 0.05},
}


def test_a_clip_that_was_compressed_again_has_the_same_labels():
    frames = prefix_of(world(*MOVING, gravity=(1.0, -6.0)))[:4]
    blurred = np.stack([cv2.GaussianBlur(frame, (0, 0), 0.6) for frame in frames])
    noise = np.random.default_rng(1).integers(-9, 10, frames.shape)
    worse = (blurred + noise).clip(0, 255).astype(np.uint8)
    exact, found = labels_of(frames), labels_of(worse)
    assert found.colors == exact.colors
    assert (found.numbers == exact.numbers).mean() > 0.99
    assert found.exact < exact.exact == 1.0


def test_noise_has_no_more_colors_than_scenes_may():
    noise = np.random.default_rng(1).integers(0, 256, (2, 64, 64, 3), np.uint8)
    assert len(labels_of(np.repeat(noise, 4, axis=1).repeat(4, axis=2)).colors) <= (
        MOST_COLORS
    )


@pytest.mark.parametrize(
    ("shape", "told"),
    [((0, 64, 64, 3), "with a frame at least"), ((2, 64, 64, 3), "nothing but")],
)
def test_a_prefix_without_anything_is_refused(shape, told):
    with pytest.raises(ValueError, match=told):
        labels_of(np.zeros(shape, np.uint8))


def test_liquid_that_spins_in_flight_tells_gravity():
    """It changes its shape, but its middle flies as any other."""
    data = world("brick", gravity=(-1.6, -6.6)).to_data()
    data["objects"][0]["physics_properties"] = prior().typical("liquid")
    data["objects"][0]["initial_state"]["angular_velocity"] = -3.0
    sight = sight_of(checked(data))
    assert sight.gravities[0].sure
    assert sight.gravities[0].value == pytest.approx((-1.6, -6.6), abs=0.2)


def test_frames_until_bodies_touch_are_counted():
    data = world("brick", "ball", "still").to_data()
    brick, ball, still = data["objects"]
    brick["shape"] |= {"center": [0.4, 0.6], "angle_deg": 0.0}
    brick["initial_state"] = {"velocity": [1.0, 0.0], "angular_velocity": 0.0}
    ball["shape"]["center"] = [0.64, 0.6]  # 0.1 m to its left are 5 frames
    still["shape"]["center"] = [0.4, 0.2]
    things = sight_of(checked(data)).things
    numbers = {thing.track.color: number for number, thing in enumerate(things)}
    until = alone_until(things)
    assert until.keys() == {numbers[COLORS[0]], numbers[COLORS[1]]}
    assert set(until.values()) <= {4, 5}


@pytest.mark.parametrize("gravity", [(0.0, -9.8), (0.0, -1.0)])
def test_a_gravity_that_many_scenes_share_is_meant_exactly(gravity):
    _, sight, _ = seen("brick", "ball", gravity=gravity)
    assert sight.gravities[0].value == gravity and sight.gravities[0].sure


def test_a_gravity_near_to_a_weak_one_is_another_if_it_is_not_that_near():
    _, sight, _ = seen("brick", "ball", gravity=(0.5, -1.4))
    assert sight.gravities[0].value == pytest.approx((0.5, -1.4), abs=0.15)
