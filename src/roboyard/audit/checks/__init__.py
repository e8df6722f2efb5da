"""All checks, one file a topic; importing this package fills `registry.CHECKS` in the order of the report."""

from roboyard.audit.checks import (  # noqa: I001
    file as file,
    xml as xml,
    tree as tree,
    joints as joints,
    limits as limits,
    mimics as mimics,
    inertials as inertials,
    masses as masses,
    geometries as geometries,
    meshes as meshes,
    mesh_sizes as mesh_sizes,
    mesh_axes as mesh_axes,
    collisions as collisions,
    names as names,
    materials as materials,
    units as units,
)
