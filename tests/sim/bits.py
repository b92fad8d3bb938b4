"""SHA-256 of what programs give, and few seeds of all materials."""

from dataclasses import dataclass
from hashlib import sha256

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import frames_sha256
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scale import rescale

CELLS = 64
VARIED = (  # together of all materials that seeds have; a test holds it
    "s12_pinwheel_block",
    "s16_honey_ramp",
    "s19_five_materials",
    "s26_hose_on_targets",
    "s34_wrecking_ball",
)


@dataclass(frozen=True)
class Bits:
    """SHA-256 of all frames, and of places, velocities and poses at all frames."""

    frames: str
    states: str


def bits_of(program, frames=None, compiler="taichi"):
    """Run a program, which must end well."""
    outcome = run(program, frames, states=True, compiler=compiler, trusted=True)
    pictures, track = outcome.expect(), outcome.states
    parts = track.positions, track.velocities, track.poses, track.rates
    states = sha256(b"".join(part.tobytes() for part in parts))
    return Bits(frames_sha256(pictures), states.hexdigest())


def small_program(name, frames):
    """Program of a seed at few cells and frames."""
    return link(rescale(load_seeds()[name], CELLS, 2 * CELLS, frames))
