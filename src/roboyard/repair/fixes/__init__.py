"""All fixes, in the order in which they are made.

Reading, joints, mimics, colours, scales, inertias, references, names: scales come before inertias, since they
change volumes; names come last, so that the log names every element as the file does.
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
