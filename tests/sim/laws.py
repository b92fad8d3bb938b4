"""Constitutive laws for many F at once: the strain that is kept, and its stress."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from mpmworlds.sim.scene.objects import MATERIALS
from tests.sim.lab import Particles, code_of

MU, LAM = 1.0, 1.5  # of all laws below
MODULI = {"youngs_modulus": 2.6, "poissons_ratio": 0.3}
SIN, COS = np.sin(np.radians(35.0)), np.cos(np.radians(35.0))
BOND = 0.1  # cohesion of wet sand
YIELD = 0.2  # shear stress at which the others yield
SLOPE = 0.5  # of hardening
STEP = 1e-6  # of finite differences
FLOW_STEP = 1.0  # time [s] over which fluids below flow much


@dataclass(frozen=True)
class Strained:
    """Deformations that are kept (n, 2, 2), states (n,), stresses (n, 2, 2)."""

    F: np.ndarray
    states: dict
    tau: np.ndarray

    @property
    def mean(self):
        """Mean stress (n,)."""
        return 0.5 * self.tau.trace(axis1=1, axis2=2)

    @property
    def shear(self):
        """Largest shear stress (n,)."""
        low, high = np.linalg.eigvalsh(self.tau).T
        return 0.5 * (high - low)

    @property
    def q(self):
        """The one other state (n,)."""
        (q,) = self.states.values()
        return q


class Law:
    """The law of a material over a time step: F and states -> `Strained`.

    It is the code that programs get of the material, run over arrays. `number` is the
    name of a number that is given for each input instead.
    """

    def __init__(self, material, dt):
        model = material.constitutive_model
        hooks = material.hooks(frozenset({model}))
        self.is_mesh = bool(code_of(hooks, model, "tighten"))
        if self.is_mesh:  # first Piola stress P of triangles
            lines = code_of(hooks, model, "tighten")
            self.particles = Particles(lines, "P", {"F": "mat2"}, DT=dt)
        else:
            lines = code_of(hooks, model, "stress")
            self.particles = Particles(lines, DT=dt)

    def __call__(self, F, q=None, **states):
        """Strain and stress after a step without motion; q is the one other state."""
        own = [n for n, first in self.particles.starts.items() if np.ndim(first) == 0]
        if q is not None and own:
            states |= {own[0]: q}
        found = self.particles(F=F, **states)
        if self.is_mesh:
            kept, tau = F, found["outcome"] @ np.swapaxes(F, -1, -2)
        else:
            kept, tau = found["F"], found["stress"]
        return Strained(kept, {name: found[name] for name in own}, tau)


@cache
def law(model, dt=FLOW_STEP, **numbers):
    """Law of a material of a model with moduli MU and LAM, and other numbers."""
    given = {"constitutive_model": model, "density": 1.0, **MODULI, **numbers}
    return Law(MATERIALS[model].model_construct(**given), dt)


def wet(F, q=1.0):
    """Wet sand of cohesion BOND, at half saturation."""
    return law("wet_sand", cohesion=BOND, friction_angle_deg=35.0)(F, q, saturation=0.5)


def paste(F, q=1.0, dt=FLOW_STEP, k=YIELD, eta=2.0, n=1.0):
    """Herschel-Bulkley fluid."""
    given = {"yield_stress": k, "consistency": eta, "exponent": n}
    return law("viscoplastic", dt, **given)(F, q)


def maxwell(F, q=1.0, dt=FLOW_STEP, time=2.0):
    """Maxwell fluid."""
    return law("viscoelastic", dt, relaxation_time=time)(F, q)


def plastic(F, q=1.0, slope=0.0):
    """Plastic solid."""
    return law("plastic", yield_stress=YIELD, hardening_modulus=slope)(F, q)


SAND = law("sand", friction_angle_deg=35.0)
INSTANT = {  # laws without memory of time: F, q -> Strained
    "sand": SAND,
    "wet_sand": wet,
    "plastic": plastic,
    "plastic that hardens": lambda F, q=1.0: plastic(F, q, SLOPE),
}
FLOWING = {  # over a step of time in which they flow much
    "viscoplastic": paste,
    "viscoplastic that thins": lambda F, q=1.0: paste(F, q, n=0.5),
    "viscoplastic that thickens": lambda F, q=1.0: paste(F, q, n=2.0),
    "viscoelastic": maxwell,
}
YIELDING = INSTANT | FLOWING
NAMED = {name.split(" ")[0] for name in YIELDING}
OTHERS = {  # all else in the schema that has a deformation gradient
    model: law(model)
    for model, kind in MATERIALS.items()
    if "youngs_modulus" in kind.model_fields and model not in NAMED
}
LAWS = OTHERS | YIELDING


def pressed(J):
    """Mean stress of the laws near Hencky's at a volume ratio."""
    return 0.5 * (MU + LAM) * (J - 1 / J)


def energy_corotated(F):
    """mu |F - R|^2 + lam (J - 1)^2 / 2."""
    s = np.linalg.svd(F, compute_uv=False)
    return MU * ((s - 1) ** 2).sum(-1) + 0.5 * LAM * (s.prod(-1) - 1) ** 2


def energy_near_hencky(F):
    """(mu + lam) (J + 1 / J - 2) / 2 + 4 mu log cosh e.

    e is half the difference of the principal log strains. For small strains that is
    mu |e|^2 + lam (tr e)^2 / 2 of the log strains, the energy of Hencky.
    """
    s = np.linalg.svd(F, compute_uv=False)
    J, e = s.prod(-1), 0.5 * np.log(s[..., 0] / s[..., 1])
    return 0.5 * (MU + LAM) * (J + 1 / J - 2) + 4 * MU * np.log(np.cosh(e))


ENERGIES = dict.fromkeys(YIELDING, energy_near_hencky) | {
    "elastic": energy_corotated,
    "elastic_fem": energy_corotated,
}
HARDENED = {"snow"}  # moduli depend on another state; see test_physics


def work_conjugate(energy, F):
    """(d energy / dF) F^T by central differences, (n, 2, 2)."""
    P = np.zeros_like(F)
    for i, j in np.ndindex(2, 2):
        dF = np.zeros((2, 2))
        dF[i, j] = STEP
        P[:, i, j] = (energy(F + dF) - energy(F - dF)) / (2 * STEP)
    return P @ F.transpose(0, 2, 1)
