"""Convex parts of link meshes: hulls, excess, missing volume and seconds, by method.

    python benchmarks/convex.py [--methods convex,split,coacd] [--hulls 8] [--links 12]

Visual meshes of the robots in `pybullet_data` and `example_robot_data` where installed, else the bundled
ones: the largest by number of triangles. Excess and missing are shares of the solid's volume on a filled
voxel grid. Nothing is taken from the cache.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from link_meshes import find_robots, link_meshes

from roboyard.shapes.convex.batch import decompose_many
from roboyard.shapes.convex.decomposition import decompose
from roboyard.shapes.mesh import TriangleMesh


def heaviest_links(count: int) -> dict[str, TriangleMesh]:
    """The meshes with most triangles, at most three of a robot."""
    chosen: dict[str, TriangleMesh] = {}
    for robot, path in find_robots().items():
        meshes = {
            f"{robot}/{link}": max(parts, key=lambda mesh: len(mesh.faces))
            for link, parts in link_meshes(path, "visual").items()
        }
        largest = sorted(meshes, key=lambda name: -len(meshes[name].faces))[:3]
        chosen.update({name: meshes[name] for name in largest})
    return dict(sorted(chosen.items(), key=lambda item: -len(item[1].faces))[:count])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--methods", default="convex,split,coacd")
    parser.add_argument("--hulls", type=int, default=8)
    parser.add_argument("--links", type=int, default=12)
    arguments = parser.parse_args()
    links = heaviest_links(arguments.links)
    decompose(next(iter(links.values())), "split", use_cache=False)
    print(f"{'mesh':32} {'faces':>7} {'method':8} {'hulls':>5} {'excess':>7} {'missing':>8} {'seconds':>8}")
    for method in arguments.methods.split(","):
        made = []
        begin = time.perf_counter()
        for name, mesh in links.items():
            result = decompose(mesh, method, hull_count=arguments.hulls, use_cache=False)
            made.append(result)
            print(
                f"{name[:32]:32} {len(mesh.faces):7} {result.method_used:8} {len(result.hulls):5} "
                f"{result.excess:7.3f} {result.missing:8.3f} {result.seconds:8.2f}",
                flush=True,
            )
        alone = time.perf_counter() - begin
        begin = time.perf_counter()
        decompose_many(list(links.values()), method, hull_count=arguments.hulls, workers=2, use_cache=False)
        print(
            f"{'median':32} {'':7} {method:8} {np.mean([len(m.hulls) for m in made]):5.1f} "
            f"{np.median([m.excess for m in made]):7.3f} {np.median([m.missing for m in made]):8.3f} "
            f"{np.median([m.seconds for m in made]):8.2f}   all: {alone:.1f} s, two workers: "
            f"{time.perf_counter() - begin:.1f} s"
        )


if __name__ == "__main__":
    main()
