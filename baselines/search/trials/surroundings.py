"""What things touch: walls, laws of colliders, belts; and spins, which that shows."""

import copy
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.search.trials.moves import spins_unseen, started
from mpmworlds.baselines.search.trials.readings import classes_of, distinct
from mpmworlds.baselines.search.trials.tried import HOPELESS, Tried

Data = dict[str, Any]

LAWS: Final = ("separate", "sticky", "slip")  # of colliders, the usual one first
CONTENDERS: Final = 3  # kinds of matter that walls are tried with, and
CONTENDS: Final = 1.2  # loss over the best one's up to which they are
EXPLAINED: Final = 0.1  # loss of a scene after which nothing far from it is sought
OFTEN_BELTS: Final = 0.5  # share of belts from which on they are tried at once
UNSEEN_SPIN: Final = 3.3  # of balls that spin: 2.5 to 4.8 in train [rad/s]
HARDLY_BELTS: Final = 0.05  # share of belts below which none is tried


class Surroundings:
    """Tries walls and colliders.

    Parameters
    ----------
    tried
        Where scenes are tried.
    """

    def __init__(self, tried: Tried) -> None:
        self._tried, self._prior = tried, tried.prior
        self._doubted = tried.known.doubt.walls
        self._out: set[tuple[str, tuple[str, ...]]] = set()

    def walls(self) -> None:
        """Each law of the walls, rough and smooth, with the best matter so far.

        Walls make up for matter: they are tried with the next best matter, too, unless
        the best one leaves little to be explained.
        """
        if not self._doubted:
            return
        best, *others = distinct(self._tried.trials, classes_of)[:CONTENDERS]
        if best.loss < EXPLAINED:
            others = []
        for start in [best, *(t for t in others if t.loss < CONTENDS * best.loss)]:
            for walls in self._prior.walls:
                usual = walls["frictions"]
                for friction in dict.fromkeys((usual[0], usual[len(usual) // 2])):
                    self._try_walls(start.data, walls["contact"], friction)
        self._everywhere()

    def other_walls(self, *, all_laws: bool = False) -> None:
        """Other laws of the walls, and a little more and less friction, while it helps.

        Frictions are those that are usual: most scenes have one of a handful. Laws that
        were hopeless when other numbers were not known are tried if `all_laws`.
        """
        if all_laws:
            self._out.clear()
        while self._doubted:
            before = self._tried.best
            now = before.data["environment"]["walls"]
            for walls in self._prior.walls:
                usual, law = walls["frictions"], walls["contact"]
                key = law, classes_of(before.data)
                if key in self._out and law != now["contact"]:
                    continue
                nearest = self._prior.usual_friction(now | {"contact": law})
                place = usual.index(nearest)
                reach = 1 if law == now["contact"] else 0
                for friction in usual[max(place - reach, 0) : place + reach + 1]:
                    loss = self._try_walls(before.data, law, friction)
                    if loss > HOPELESS * self._tried.best.loss:
                        self._out.add(key)
            self._everywhere()
            if self._tried.best is before:
                return

    def _try_walls(self, data: Data, law: str, friction: float) -> float:
        walls = {"contact": law, "friction": friction}
        if walls.items() <= data["environment"]["walls"].items():
            return 0.0
        changed = copy.deepcopy(data)
        changed["environment"]["walls"] |= walls
        return self._tried.run(changed, f"walls {law} {friction}").loss

    def _everywhere(self) -> None:
        """Colliders of the law of the walls: they often are."""
        best = self._tried.best.data
        changed = copy.deepcopy(best)
        law = changed["environment"]["walls"]["contact"]
        for number, thing in enumerate(changed["objects"]):
            if "contact" in thing and "contact" not in self._tried.told(number):
                thing["contact"]["type"] = law
        if changed != best and self._tried.known.touched:
            self._tried.run(changed, f"{law} everywhere")

    def colliders(self) -> None:
        """Other laws of each collider that something touches."""
        for number in self._tried.known.touched:
            if "contact" in self._tried.told(number):
                continue
            before = self._tried.best.data
            for law in LAWS:
                changed = copy.deepcopy(before)
                contact = changed["objects"][number]["contact"]
                if contact["type"] != law:
                    contact["type"] = law
                    self._tried.run(changed, f"{number} {law}")

    def belts(self, share: float = HARDLY_BELTS) -> None:
        """Still things that matter comes near to may be belts.

        Those are tried of whose shapes more than a share are.
        """
        usual = self._prior.belt_speed
        for number in self._tried.known.touched:
            before = self._tried.best.data
            thing = before["objects"][number]
            likely = self._prior.belt_share(thing) > share
            told = self._tried.told(number).get("object_type")
            if told or not likely or thing["object_type"] != "static_collider":
                continue
            for speed in (usual, -usual):
                changed = copy.deepcopy(before)
                belt = changed["objects"][number]
                belt["object_type"] = "kinematic_collider"
                belt["kinematics"] = {"type": "conveyor", "surface_speed": speed}
                belt["contact"] = self._prior.contact_of(belt)
                self._tried.run(changed, f"{number} is a belt")

    def spins(self) -> None:
        """Balls that move may spin, which is not seen before they land."""
        for number in range(len(self._tried.best.data["objects"])):
            before = self._tried.best.data
            state = before["objects"][number].get("initial_state", {})
            spun = state.get("angular_velocity") or not any(state.get("velocity", ()))
            told = self._tried.told(number)
            if spun or not spins_unseen(before["objects"][number], told):
                continue
            for spin in (UNSEEN_SPIN, -UNSEEN_SPIN):
                changed = started(before, number, angular_velocity=spin)
                self._tried.run(changed, f"{number} spins")

    def drawn(self, data: Data, draw: np.random.Generator) -> Data:
        """A scene with walls as often as they are in the train split."""
        changed = copy.deepcopy(data)
        if self._doubted:
            shares = np.array([w["share"] for w in self._prior.walls])
            law = self._prior.walls[draw.choice(len(shares), p=shares / shares.sum())]
            changed["environment"]["walls"] |= {
                "contact": law["contact"],
                "friction": float(draw.choice(law["frictions"])),
            }
        return changed
