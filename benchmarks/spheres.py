"""Collision spheres: quality by the exact metrics and seconds, at fixed counts and by preset.

    python benchmarks/spheres.py [--robots panda,tiago] [--samples 2500] [--published]

Robots are those of `pybullet_data` and `example_robot_data` where installed, else the bundled ones. Figures
are means over the links that have collision shapes; the gap is the largest of any link. Times are of a warm
process, meshes loaded. `--published` compares with other people's sets for the panda, sphere for sphere.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import numpy as np
from link_meshes import find_robots, link_meshes

from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.spheres.fit import PRESETS, SpherePreset, fit_spheres
from roboyard.shapes.spheres.metrics import measure_spheres

HEAD = f"{'robot':10} {'set':9} {'links':>5} {'spheres':>7} {'coverage':>8} {'protrusion':>10} {'mean mm':>8}"
HEAD += f" {'gap mm':>7} {'excess':>7} {'ms/link':>8} {'seconds':>8}"


PUBLISHED = {
    "cuRobo, by hand": (59, 0.606, 0.241),
    "foam's sample": (57, 0.772, 0.386),
    "MorphIt n=4": (36, 0.972, 0.543),
    "MorphIt n=8": (67, 0.970, 0.356),
    "MorphIt n=16": (120, 0.962, 0.309),
    "MorphIt n=32": (178, 0.965, 0.259),
}
"""Spheres, coverage and protrusion on the panda's ten meshes, measured as here: means over the meshes."""


def published(links: Sequence[list[TriangleMesh]], samples: int) -> None:
    """Each published set beside a fit with as many spheres, spread evenly, that covers a little more."""
    print(f"{'set':16} {'spheres':>7} {'coverage':>17} {'protrusion':>17} {'excess':>7}")
    for name, (total, coverage, protrusion) in PUBLISHED.items():
        worth = 4.0 if coverage > 0.9 else 0.3
        goal = SpherePreset(density=6, worth=worth, coverage=coverage + 0.002, surface=0, excess=9)
        counts = [total // len(links) + (k < total % len(links)) for k in range(len(links))]
        fits = [fit_spheres(meshes, count, goal) for meshes, count in zip(links, counts, strict=True)]
        exact = [
            measure_spheres(meshes, fit.centers, fit.radii, samples=samples)
            for meshes, fit in zip(links, fits, strict=True)
        ]
        ours = [
            float(np.mean([getattr(e, key) for e in exact])) for key in ("coverage", "protrusion", "excess")
        ]
        covered, outside = f"{coverage:7.3f} -> {ours[0]:6.3f}", f"{protrusion:7.3f} -> {ours[1]:6.3f}"
        print(f"{name:16} {total:7} {covered} {outside} {ours[2]:7.3f}")


def row(
    robot: str,
    label: str,
    links: Sequence[list[TriangleMesh]],
    samples: int,
    count: int | None,
    preset: str,
) -> str:
    begin = time.perf_counter()
    fits = [fit_spheres(meshes, count, preset) for meshes in links]  # type: ignore[arg-type]
    seconds = time.perf_counter() - begin
    exact = [
        measure_spheres(meshes, fit.centers, fit.radii, samples=samples)
        for meshes, fit in zip(links, fits, strict=True)
    ]
    mean = {
        name: np.mean([getattr(figures, name) for figures in exact])
        for name in ("coverage", "protrusion", "mean_protrusion_mm", "excess")
    }
    spheres = sum(len(fit.radii) for fit in fits)
    gap = max(figures.max_gap_mm for figures in exact)
    return (
        f"{robot:10} {label:9} {len(links):5} {spheres:7} {mean['coverage']:8.3f} "
        f"{mean['protrusion']:10.3f} {mean['mean_protrusion_mm']:8.1f} {gap:7.1f} {mean['excess']:7.3f} "
        f"{1e3 * seconds / len(links):8.1f} {seconds:8.2f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", default="", help="names, separated by commas; all that are found")
    parser.add_argument("--samples", type=int, default=2500, help="Monte Carlo points for each figure")
    parser.add_argument("--published", action="store_true", help="compare with published sets for the panda")
    arguments = parser.parse_args()
    if arguments.published:
        links = link_meshes(find_robots()["panda"])
        published([m for name, m in links.items() if name != "panda_rightfinger"], arguments.samples)
        return
    wanted = [name for name in arguments.robots.split(",") if name]
    robots = {name: path for name, path in find_robots().items() if not wanted or name in wanted}
    print(HEAD)
    warm = False
    for name, path in robots.items():
        links = list(link_meshes(path).values())
        if not warm:
            fit_spheres(links[0])
            warm = True
        for count in (4, 8, 16, 32):
            print(row(name, f"n={count}", links, arguments.samples, count, "balanced"), flush=True)
        for preset in PRESETS:
            print(row(name, preset, links, arguments.samples, None, preset), flush=True)


if __name__ == "__main__":
    main()
