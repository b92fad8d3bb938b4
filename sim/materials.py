"""Constitutive models: their parameters, wave speeds, and the lines that use them.

A material is a `Part` with the fields that the scene gives, and `STRESS`: the lines of
a program's `stress` function for it. They may use the particle index `p`, the time step
`DT`, the particle fields `a b c d q` and the material's parameters as `m["name"]`; they
set the Kirchhoff stress `t, z`. Every function they call is linked from `physics`.
"""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from mpmworlds.sim.fields import Part, about

DENSITY = {"ge": 1.0, "le": 1e5}


class Material(Part):
    """What every material has."""

    FAMILY: ClassVar[str]  # group in reports
    STRESS: ClassVar[str]

    density: float = about("material", "mass per area at rest", "kg/m^2", **DENSITY)

    def wave_speed(self) -> float:
        """Speed of the fastest elastic wave [m/s]; it bounds the time step."""
        raise TypeError(f"{type(self).__name__} has no wave speed")


class Solid(Material):
    """A material with Young's modulus and Poisson's ratio."""

    youngs_modulus: float = about("material", "stiffness", "Pa", ge=1e2, le=1e9)
    poissons_ratio: float = about("material", "lateral contraction", ge=0.0, le=0.45)

    def wave_speed(self) -> float:
        """Pressure waves: sqrt((lam + 2 mu) / rho)."""
        nu = self.poissons_ratio
        p_wave = self.youngs_modulus * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
        return math.sqrt(p_wave / self.density)


class Liquid(Material):
    """Weakly compressible Newtonian liquid."""

    FAMILY = "liquid"
    STRESS = """\
q[p], t = compress(q[p], c[p], DT, m["bulk_modulus"])
t, z = newtonian(t, z, m["viscosity"], c[p], d[p])
"""
    constitutive_model: Literal["liquid"] = about("material", "constitutive model")
    bulk_modulus: float = about("material", "stiffness in volume", "Pa", ge=1e2, le=1e9)
    viscosity: float = about(
        "material", "dynamic viscosity", "Pa s", default=0.0, ge=0.0, le=1e4
    )

    def wave_speed(self) -> float:
        """Sound: sqrt(K / rho)."""
        return math.sqrt(self.bulk_modulus / self.density)


class Elastic(Solid):
    """Fixed corotated elasticity with Kelvin-Voigt damping."""

    FAMILY = "elastic/plastic"
    STRESS = """\
mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
t, z = fixed_corotated(a[p], b[p], mu, lam)
t, z = newtonian(t, z, m["damping"], c[p], d[p])
"""
    constitutive_model: Literal["elastic"] = about("material", "constitutive model")
    damping: float = about(
        "material", "Kelvin-Voigt viscosity", "Pa s", default=0.0, ge=0.0, le=1e4
    )


class Snow(Solid):
    """Snow: yields beyond small strains and hardens under compaction."""

    FAMILY = "snow"
    STRESS = """\
mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
compression, stretch = m["yield_compression"], m["yield_stretch"]
a[p], b[p], q[p] = pack(a[p], b[p], q[p], compression, stretch)
lowest, highest = m["hardening_min"], m["hardening_max"]
h = hardening(q[p], m["hardening_rate"], lowest, highest)
t, z = fixed_corotated(a[p], b[p], h * mu, h * lam)
"""
    constitutive_model: Literal["snow"] = about("material", "constitutive model")
    yield_compression: float = about(
        "material", "critical compression", default=2.5e-2, gt=0.0, le=0.5
    )
    yield_stretch: float = about(
        "material", "critical stretch", default=5.0e-3, gt=0.0, le=0.5
    )
    hardening_rate: float = about(
        "material", "exponent of hardening", default=10.0, ge=0.0, le=20.0
    )
    hardening_min: float = about(
        "material", "least hardening factor", default=0.1, gt=0.0, le=1.0
    )
    hardening_max: float = about(
        "material", "greatest hardening factor", default=5.0, ge=1.0, le=20.0
    )

    def wave_speed(self) -> float:
        """Pressure waves in fully hardened snow."""
        return super().wave_speed() * math.sqrt(self.hardening_max)


class Sand(Solid):
    """Dry sand: Mohr-Coulomb friction, no cohesion."""

    FAMILY = "sand"
    STRESS = """\
mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
sin_phi = ti.sin(ti.math.radians(m["friction_angle_deg"]))
a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
a[p], b[p], q[p], t, z = hencky_sand(a[p], b[p], q[p], mu, lam, sin_phi)
"""
    constitutive_model: Literal["sand"] = about("material", "constitutive model")
    friction_angle_deg: float = about(
        "material", "internal friction angle", "deg", default=35.0, ge=5.0, le=60.0
    )


AnyMaterial = Annotated[
    Liquid | Elastic | Snow | Sand, Field(discriminator="constitutive_model")
]
MATERIALS: dict[str, type[Material]] = {
    "elastic": Elastic,
    "liquid": Liquid,
    "sand": Sand,
    "snow": Snow,
}
