"""The roles of a scene's objects in its program."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from mpmworlds.sim.program.features.material import Material, Numbers
from mpmworlds.sim.scene.scene import Scene

Calls = tuple[tuple[str, str, Numbers], ...]  # module, name and numbers of hooks


def is_rigid(thing: Any) -> bool:
    """Whether an object is a rigid body."""
    found: bool = (
        thing.object_type == "dynamic_body"
        and thing.physics_properties.constitutive_model == "rigid"
    )
    return found


def is_still(thing: Any) -> bool:
    """Whether an object is a collider that stays where it is, perhaps with a belt."""
    if thing.object_type == "kinematic_collider":
        return bool(thing.kinematics.type == "conveyor")
    return bool(thing.object_type == "static_collider")


def is_mesh(thing: Any) -> bool:
    """Whether an object is a body that is a mesh."""
    found: bool = (
        thing.object_type == "dynamic_body"
        and thing.physics_properties.constitutive_model == "elastic_fem"
    )
    return found


@dataclass(frozen=True, eq=False)
class Cast:
    """A scene and the roles of its objects.

    Matter is numbered from 0, and so are solids: rigid bodies, then movers, then those
    that are still. In the palette the background comes first, then matter, then solids.
    """

    scene: Scene

    @cached_property
    def matter(self) -> list[Any]:
        """Bodies and nozzles whose matter consists of particles."""
        return [
            o
            for o in self.scene.objects
            if hasattr(o, "physics_properties") and not is_rigid(o)
        ]

    @cached_property
    def bodies(self) -> list[Any]:
        """Of matter, what is there from the start."""
        return [o for o in self.matter if o.object_type == "dynamic_body"]

    @cached_property
    def nozzles(self) -> list[Any]:
        """Of matter, what is released."""
        return [o for o in self.matter if o.object_type == "emitter"]

    @cached_property
    def rigid(self) -> list[Any]:
        """Rigid bodies."""
        return [o for o in self.scene.objects if is_rigid(o)]

    @cached_property
    def movers(self) -> list[Any]:
        """Colliders that change place."""
        return [
            o
            for o in self.scene.objects
            if o.object_type == "kinematic_collider" and not is_still(o)
        ]

    @cached_property
    def still(self) -> list[Any]:
        """Colliders that stay where they are."""
        return [o for o in self.scene.objects if is_still(o)]

    @cached_property
    def timed_belts(self) -> list[Any]:
        """Colliders with a belt that does not run all the time."""
        return [
            o
            for o in self.still
            if o.object_type == "kinematic_collider" and o.kinematics.is_timed()
        ]

    @cached_property
    def solids(self) -> list[Any]:
        """Those that have a Taichi function: what rigid bodies meet, or what moves."""
        return self.rigid + self.movers + (self.still if self.rigid else [])

    @cached_property
    def is_moving(self) -> bool:
        """Whether matter has a velocity at the start."""
        states = [thing.initial_state for thing in self.bodies]
        return bool(self.nozzles) or any(any(state.velocity) for state in states)

    @cached_property
    def is_alone(self) -> bool:
        """Whether all particles belong to the same object and are alike."""
        return len(self.matter) == 1 and not is_mesh(self.matter[0])

    @cached_property
    def materials(self) -> list[Material]:
        """Of matter, by its number."""
        return [thing.physics_properties for thing in self.matter]

    @cached_property
    def firm(self) -> list[int]:
        """Numbers of matter into which nothing is released."""
        return [k for k, m in enumerate(self.materials) if not m.GIVES_WAY]

    def calls(self, k: int) -> Calls:
        """Hooks that the particles of object k go through."""
        models = sorted({m.constitutive_model for m in self.materials})
        own = self.materials[k]
        found = [
            (module or own.constitutive_model, name, numbers)
            for key, numbers in own.hooks(frozenset(models)).items()
            for module, _, name in [key.rpartition(".")]
        ]
        for other in self.materials:
            call = tuple(
                (other.constitutive_model, name, numbers)
                for name, numbers in other.gives(own.constitutive_model).items()
            )
            found += [each for each in call if each not in found]
        if self.nozzles and k in self.firm and len(self.firm) < len(self.matter):
            found.append(("outline", "fill_up", {}))
        return tuple(found)


def weights_of(thing: Any) -> tuple[float, float]:
    """Mass [kg] and moment of inertia [kg m^2] of a rigid body, to six digits."""
    area, _, _, second = thing.shape.moments()
    density = thing.physics_properties.density
    return float(f"{density * area:.6g}"), float(f"{density * second:.6g}")
