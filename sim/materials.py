"""Constitutive models: their parameters, wave speeds, and the lines that use them.

A material is a `Part` with the fields that the scene gives, and `STRESS`: the lines of
a program's `stress` function for it. They may use the particle index `p`, the time step
`DT`, the particle fields `a b c d q`, in wet sand `saturation`, and the material's
parameters as `m["name"]`; they set the Kirchhoff stress `t, z`. Every function they
call is linked from `physics`.
"""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from mpmworlds.sim.scene.fields import Part, about

DENSITY = {"ge": 1.0, "le": 1e5}


class Material(Part):
    """What every material has."""

    FAMILY: ClassVar[str]  # group in reports
    STRESS: ClassVar[str]

    density: float = about("material", "mass per area at rest", "kg/m^2", **DENSITY)

    def wave_speed(self) -> float:
        """Speed of the fastest elastic wave [m/s]; it bounds the time step."""
        raise TypeError(f"{type(self).__name__} has no wave speed")

    def kinematic_viscosity(self) -> float:
        """Viscosity per density [m^2/s] of explicit stress; it bounds the time step."""
        return 0.0


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

    def kinematic_viscosity(self) -> float:
        """That of the liquid: eta / rho."""
        return self.viscosity / self.density


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

    def kinematic_viscosity(self) -> float:
        """That of the damping: eta / rho."""
        return self.damping / self.density


class ElasticFem(Solid):
    """Fixed corotated elasticity of a triangle mesh, which never tears."""

    FAMILY = "elastic/plastic"
    STRESS = 't, z = newtonian(t, z, m["damping"], c[p], d[p])\n'
    constitutive_model: Literal["elastic_fem"] = about("material", "constitutive model")
    damping: float = about(
        "material", "Kelvin-Voigt viscosity", "Pa s", default=0.0, ge=0.0, le=1e4
    )

    def kinematic_viscosity(self) -> float:
        """That of the damping: eta / rho."""
        return self.damping / self.density


class Plastic(Solid):
    """Elastic up to a yield stress, which hardening raises; then it deforms for good.

    The yield stress is that in shear: a bar yields at sqrt(3) of it.
    """

    FAMILY = "elastic/plastic"
    STRESS = """\
mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
k, slope = m["yield_stress"], m["hardening_modulus"]
a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
a[p], b[p], q[p], t, z = hencky_plastic(a[p], b[p], q[p], mu, lam, k, slope)
"""
    constitutive_model: Literal["plastic"] = about("material", "constitutive model")
    yield_stress: float = about(
        "material", "shear stress at which it yields", "Pa", ge=1.0, le=1e8
    )
    hardening_modulus: float = about(
        "material", "rise per plastic shear strain", "Pa", default=0.0, ge=0.0, le=1e8
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


class Grains(Solid):
    """Grains with Mohr-Coulomb friction."""

    FAMILY = "sand"

    friction_angle_deg: float = about(
        "material", "internal friction angle", "deg", default=35.0, ge=5.0, le=60.0
    )


class Sand(Grains):
    """Dry sand: Mohr-Coulomb friction, no cohesion."""

    STRESS = """\
mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
phi = ti.math.radians(m["friction_angle_deg"])
a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
a[p], b[p], q[p], t, z = hencky_sand(a[p], b[p], q[p], mu, lam, phi, 0.0)
"""
    constitutive_model: Literal["sand"] = about("material", "constitutive model")


class WetSand(Grains):
    """Sand whose grains cohere, most at half saturation; liquid nearby soaks it."""

    STRESS = """\
mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
phi = ti.math.radians(m["friction_angle_deg"])
bond = cohesion(saturation[p], m["cohesion"])
a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
a[p], b[p], q[p], t, z = hencky_sand(a[p], b[p], q[p], mu, lam, phi, bond)
"""
    constitutive_model: Literal["wet_sand"] = about("material", "constitutive model")
    cohesion: float = about(
        "material", "cohesion at half saturation", "Pa", default=2e3, ge=0.0, le=1e6
    )
    saturation: float = about(
        "material", "wet part of the pores at the start", default=0.3, ge=0.0, le=1.0
    )


class Viscoplastic(Solid):
    """Herschel-Bulkley fluid: rests below its yield stress, flows viscously above."""

    FAMILY = "visco"
    STRESS = """\
mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
k, eta, n = m["yield_stress"], m["consistency"], m["exponent"]
a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
a[p], b[p], q[p], t, z = hencky_paste(a[p], b[p], q[p], DT, mu, lam, k, eta, n)
"""
    constitutive_model: Literal["viscoplastic"] = about(
        "material", "constitutive model"
    )
    yield_stress: float = about(
        "material", "shear stress at which it starts to flow", "Pa", ge=0.0, le=1e8
    )
    consistency: float = about(
        "material", "viscosity at a shear rate of 1/s", "Pa s^n", gt=0.0, le=1e6
    )
    exponent: float = about(
        "material", "flow exponent; n = 1 is Bingham", default=1.0, ge=0.2, le=2.0
    )


class Viscoelastic(Solid):
    """Maxwell fluid: elastic when quick, a liquid when slow."""

    FAMILY = "visco"
    STRESS = """\
mu, lam = lame(m["youngs_modulus"], m["poissons_ratio"])
a[p], b[p] = advance(a[p], b[p], c[p], d[p], DT)
time = m["relaxation_time"]
a[p], b[p], q[p], t, z = hencky_maxwell(a[p], b[p], q[p], DT, mu, lam, time)
"""
    constitutive_model: Literal["viscoelastic"] = about(
        "material", "constitutive model"
    )
    relaxation_time: float = about(
        "material", "time in which shear stress decays to 1/e", "s", ge=1e-4, le=1e4
    )


class Rigid(Material):
    """A rigid body that pushes particles, and is pushed by them."""

    FAMILY = "rigid"
    STRESS = ""
    constitutive_model: Literal["rigid"] = about("material", "constitutive model")
    restitution: float = about(
        "material", "part of speed after a bounce", default=0.2, ge=0.0, le=1.0
    )
    friction: float = about(
        "material", "Coulomb coefficient", default=0.3, ge=0.0, le=10.0
    )
    skin_cells: float = about(
        "neutral", "distance of contact", "cells", default=0.3, ge=0.0, le=1.0
    )

    def wave_speed(self) -> float:
        """No waves: it moves as one."""
        return 0.0


Grain = Elastic | Liquid | Plastic | Sand | Snow | Viscoelastic | Viscoplastic | WetSand
EmittedMaterial = Annotated[Grain, Field(discriminator="constitutive_model")]
AnyMaterial = Annotated[
    Grain | ElasticFem | Rigid, Field(discriminator="constitutive_model")
]
MATERIALS: dict[str, type[Material]] = {
    "elastic": Elastic,
    "elastic_fem": ElasticFem,
    "liquid": Liquid,
    "plastic": Plastic,
    "rigid": Rigid,
    "sand": Sand,
    "snow": Snow,
    "viscoelastic": Viscoelastic,
    "viscoplastic": Viscoplastic,
    "wet_sand": WetSand,
}
