"""Fluids with a yield stress: overstress flow [Yue et al. 2015]."""

from typing import Literal

from mpmworlds.sim.program.features.deformation import F, parts
from mpmworlds.sim.program.features.material import Numbers, Solid
from mpmworlds.sim.program.features.materials.sand import loose
from mpmworlds.sim.program.words import (
    DT,
    C,
    hook,
    mat2,
    stress,
    ti,
)
from mpmworlds.sim.scene.fields import about


class Viscoplastic(Solid):
    """Herschel-Bulkley fluid: rests below its yield stress, flows viscously above."""

    FAMILY = "visco"

    constitutive_model: Literal["viscoplastic"] = about(
        "material", "constitutive model"
    )
    yield_stress: float = about(
        "material",
        "shear stress at which it starts to flow",
        "Pa",
        ge=0.0,
        le=1e8,
        kind="strength",
    )
    consistency: float = about(
        "material",
        "viscosity at a shear rate of 1/s",
        "Pa s^n",
        gt=0.0,
        le=1e6,
        kind="viscosity",
    )
    exponent: float = about(
        "material",
        "flow exponent; n = 1 is Bingham",
        default=1.0,
        ge=0.2,
        le=2.0,
        kind="exponent",
    )

    def hooks(self, present: frozenset[str]) -> dict[str, Numbers]:
        """Stress of Bingham's or another fluid, and volume as of liquids."""
        numbers = self.moduli() | {"k": self.yield_stress, "eta": self.consistency}
        if self.exponent == 1.0:
            return {"deform": numbers, "deformation.settle": {}}
        return {"thin": numbers | {"n": self.exponent}, "deformation.settle": {}}


@ti.func
def bingham(F, loose, E, nu, k, eta):
    """Shear k + eta (shear rate), elastic below k [Bingham]; parts beyond a tenth.

    F, the volume gained by parting, which it loses before it resists again; stress.
    """
    mu, lam = 0.5 * E / (1.0 + nu), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    J, r, R, D = parts(F)
    excess = ti.max(2.0 * mu * r - k, 0.0)
    flow = excess * mu * DT / (eta + mu * DT)
    r -= 0.5 * flow / mu
    new_loose, J = ti.max(J * loose / 1.1, 1.0), ti.min(J * loose, 1.1)
    mean = 0.5 * (mu + lam) * (J - 1.0 / J)
    tau = mean * mat2(1.0, 0.0, 0.0, 1.0) + 2.0 * mu * r * D @ R.transpose()
    return ti.sqrt(J / (1.0 - r * r)) * (R + r * D), new_loose, tau


@ti.func
def herschel_bulkley(F, loose, E, nu, k, eta, n):
    """Shear k + eta (shear rate)^n, elastic below k; parts beyond a tenth.

    F, the volume gained by parting, which it loses before it resists again; stress.
    """
    mu, lam = 0.5 * E / (1.0 + nu), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    J, r, R, D = parts(F)
    excess, flow = 2.0 * mu * r - k, 0.0
    if excess > 0.0:
        flow = excess - overstress(excess, mu * DT, eta, n)
    r -= 0.5 * flow / mu
    new_loose, J = ti.max(J * loose / 1.1, 1.0), ti.min(J * loose, 1.1)
    mean = 0.5 * (mu + lam) * (J - 1.0 / J)
    tau = mean * mat2(1.0, 0.0, 0.0, 1.0) + 2.0 * mu * r * D @ R.transpose()
    return ti.sqrt(J / (1.0 - r * r)) * (R + r * D), new_loose, tau


@ti.func
def overstress(excess, drag, eta, n):
    """Solve x + drag (x / eta)^(1/n) = excess > 0 for x [Pa]; drag = mu dt [Pa s].

    Newton's method in u = log(x / eta), where the equation is nearly linear, from the
    nearer of its limits for small and large drag: within 0.2 % for n of 0.2 to 2.
    """
    u = ti.min(ti.log(excess / eta), n * ti.log(excess / drag))
    for _ in range(2):
        rest, flow = eta * ti.exp(u), drag * ti.exp(u / n)
        u -= ti.log((rest + flow) / excess) * (rest + flow) / (rest + flow / n)
    return eta * ti.exp(u)


@hook.stress
def deform(p, E, nu, k, eta):
    F[p] += DT * C[p] @ F[p]
    F[p], loose[p], stress[p] = bingham(F[p], loose[p], E, nu, k, eta)


@hook.stress
def thin(p, E, nu, k, eta, n):
    F[p] += DT * C[p] @ F[p]
    F[p], loose[p], stress[p] = herschel_bulkley(F[p], loose[p], E, nu, k, eta, n)
