"""Cases that hold whole simulations against theory, experiment and conservation laws.

`python -m benchmarks.physics` runs them; tests run the same cases on fewer cells.
"""

from benchmarks.physics import contact as contact
from benchmarks.physics import grains as grains
from benchmarks.physics import liquid as liquid
from benchmarks.physics import motion as motion
from benchmarks.physics import rigid as rigid
from benchmarks.physics import solids as solids
from benchmarks.physics.case import CASES as CASES
