"""All mends, in the order in which they are done.

Reading, joints, mimics, colours, scales, inertias, references, names: scales come before inertias, since they
change volumes; names come last, so that the log speaks of every element by the name that the file gives it.
"""

from roboyard.repair.fixes import (  # noqa: I001
    reading as reading,
    joints as joints,
    mimics as mimics,
    materials as materials,
    meshes as meshes,
    inertials as inertials,
    references as references,
    names as names,
)
