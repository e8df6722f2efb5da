"""Connected regions of a voxel grid."""

from __future__ import annotations

from roboyard.native import compiled


@compiled("u1[:,:,::1] i4[:,:,::1] i8[::1] -> i8", releases_gil=True)
def label_regions(wall, regions, waiting):
    """Number the regions of voxels that share faces, from 1 on; returns how many there are.

    Args:
        wall: (nx, ny, nz) 1 for voxels that belong to no region.
        regions: (nx, ny, nz) zeros; written: the number of each voxel's region, 0 in the wall.
        waiting: (nx * ny * nz,) scratch.
    """
    nx, ny, nz = wall.shape
    count = 0
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                if wall[i, j, k] != 0 or regions[i, j, k] != 0:
                    continue
                count += 1
                regions[i, j, k] = count
                waiting[0] = (i * ny + j) * nz + k
                top = 1
                while top > 0:
                    top -= 1
                    at = waiting[top]
                    x, y, z = at // (ny * nz), at // nz % ny, at % nz
                    for side in range(6):
                        step = 1 if side % 2 == 0 else -1
                        u = x + (step if side < 2 else 0)
                        v = y + (step if side == 2 or side == 3 else 0)
                        w = z + (step if side > 3 else 0)
                        if u < 0 or v < 0 or w < 0 or u >= nx or v >= ny or w >= nz:
                            continue
                        if wall[u, v, w] == 0 and regions[u, v, w] == 0:
                            regions[u, v, w] = count
                            waiting[top] = (u * ny + v) * nz + w
                            top += 1
    return count
