"""Convex parts of shapes with known best parts, and the handling of CoACD failures."""

import functools
import os
import threading
import time

import numpy as np
import pytest
import trimesh

from roboyard.errors import ConfigError
from roboyard.shapes.convex import coacd_process
from roboyard.shapes.convex.batch import decompose_many
from roboyard.shapes.convex.box_splitter import clip_triangles, slice_extremes, split_convex
from roboyard.shapes.convex.decomposition import decompose
from roboyard.shapes.convex.hulls import is_convex
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.voxels.grid import voxelize


def mesh_of(shape: trimesh.Trimesh) -> TriangleMesh:
    return TriangleMesh(
        vertices=np.array(shape.vertices, dtype=np.float64), faces=np.array(shape.faces, dtype=np.int32)
    )


def boxes(*bounds) -> TriangleMesh:
    return mesh_of(trimesh.util.concatenate([trimesh.creation.box(bounds=b) for b in bounds]))


ELL = boxes([[0, 0, 0], [0.3, 0.1, 0.1]], [[0, 0.1, 0], [0.1, 0.3, 0.1]])
BOWL = trimesh.creation.icosphere(2)
BOWL.update_faces(BOWL.triangles_center[:, 2] < 0)
CHANNEL = boxes(
    [[0, 0, 0], [0.3, 0.2, 0.05]], [[0, 0, 0.05], [0.3, 0.05, 0.2]], [[0, 0.15, 0.05], [0.3, 0.2, 0.2]]
)


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOYARD_CACHE", str(tmp_path))


def volumes(made) -> list[float]:
    return [trimesh.Trimesh(hull.vertices, hull.faces).volume for hull in made.hulls]


def test_ell_splits_into_its_two_boxes():
    made = decompose(ELL, "split")
    assert made.method_used == "split"
    assert len(made.hulls) == 2
    assert sum(volumes(made)) == pytest.approx(0.005, rel=0.03)
    assert made.excess < 0.03
    assert made.missing < 0.02


def test_channel_splits_into_its_walls():
    made = decompose(CHANNEL, "split")
    assert len(made.hulls) in (3, 4)
    assert made.excess < 0.05
    assert made.missing < 0.02


def test_rotated_meshes_split_as_well():
    turn = trimesh.transformations.euler_matrix(0.3, -0.7, 1.1)
    turned = TriangleMesh(vertices=ELL.vertices @ turn[:3, :3].T + [1, 2, 3], faces=ELL.faces)
    made = decompose(turned, "split")
    assert 2 <= len(made.hulls) <= 4
    assert made.excess < 0.1


def test_torus_gets_closer_with_more_hulls():
    torus = mesh_of(trimesh.creation.torus(0.2, 0.05))
    made = [decompose(torus, "split", hull_count=n) for n in (1, 4, 8)]
    assert [m.method_used for m in made] == ["hull", "split", "split"]
    excess = [m.excess for m in made]
    assert excess == sorted(excess, reverse=True)
    assert excess[2] < 0.25
    assert all(len(m.hulls) <= n for m, n in zip(made, (1, 4, 8), strict=True))
    assert all(is_convex(hull) and len(hull.vertices) <= 60 for hull in made[2].hulls)
    assert made[2].missing < 0.04


@pytest.mark.parametrize("method", ["coacd", "split", "convex"])
def test_tight_hull_stays_one(method):
    made = decompose(mesh_of(trimesh.creation.capsule(radius=0.05, height=0.2)), method)
    assert (made.method_used, len(made.hulls)) == ("hull", 1)


def test_method_none_gives_no_hulls():
    made = decompose(ELL, None)
    assert (made.hulls, made.method_used) == ((), "none")


def test_hulls_contain_the_whole_surface():
    made = decompose(CHANNEL, "split", max_vertices=60)
    skin, _ = trimesh.sample.sample_surface(trimesh.Trimesh(CHANNEL.vertices, CHANNEL.faces), 2000, seed=0)
    outside = np.full(len(skin), np.inf)
    for hull in made.hulls:
        shape = trimesh.Trimesh(hull.vertices, hull.faces)
        reach = (skin @ shape.face_normals.T - (shape.triangles[:, 0] * shape.face_normals).sum(axis=1)).max(
            axis=1
        )
        outside = np.minimum(outside, reach)
    assert outside.max() < 1e-4


@pytest.mark.parametrize(
    "shape",
    [
        TriangleMesh(vertices=np.eye(3), faces=np.array([[0, 1, 2]], dtype=np.int32)),
        TriangleMesh(vertices=np.ones((3, 3)), faces=np.array([[0, 1, 2]], dtype=np.int32)),
        TriangleMesh(vertices=np.array([[0.0, 0, 0], [1, 0, 0]]), faces=np.zeros((0, 3), dtype=np.int32)),
        mesh_of(BOWL),
        boxes([[0, 0, 0], [1, 1, 1e-4]], [[0, 0, 0], [1e-4, 1, 1]]),
        boxes([[0, 0, 0], [1, 1, 1]], [[50, 0, 0], [51, 1, 1]]),
    ],
    ids=["triangle", "point", "vertices only", "bowl", "bent sheet", "far apart"],
)
def test_awkward_meshes_always_give_hulls(shape):
    made = decompose(shape, "split")
    assert made.hulls
    assert all(volume > 0 for volume in volumes(made))


def test_two_islands_are_two_hulls():
    made = decompose(boxes([[0, 0, 0], [1, 1, 1]], [[3, 0, 0], [4, 1, 1]]), "split")
    assert sorted(volumes(made)) == pytest.approx([1, 1], rel=0.01)


def test_second_time_comes_from_the_cache(monkeypatch):
    first = decompose(ELL, "split")
    monkeypatch.setattr(
        "roboyard.shapes.convex.decomposition.split_convex", lambda *_, **__: pytest.fail("computed again")
    )
    again = decompose(ELL, "split")
    assert again.cached
    assert not first.cached
    assert all(np.array_equal(a.vertices, b.vertices) for a, b in zip(first.hulls, again.hulls, strict=True))
    assert (again.excess, again.missing, again.notes) == (first.excess, first.missing, first.notes)


def test_damaged_cache_is_computed_again(tmp_path):
    decompose(ELL, "split")
    for entry in tmp_path.rglob("*.npz"):
        np.savez(entry, about=np.array('{"excess": "much"}'))
    assert not decompose(ELL, "split").cached
    assert decompose(ELL, "split").cached


def worker_that(tmp_path, body: str):
    script = tmp_path / "worker.py"
    script.write_text(body)
    return functools.partial(coacd_process.run_coacd, worker=script)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("import os; os.abort()", "exited with status"),
        ("raise SystemExit(3)", "status 3"),
        ("import time; time.sleep(60)", "longer than 0.5 s"),
        ("", "no readable file"),
    ],
    ids=["abort", "exit", "hang", "no answer"],
)
def test_failing_coacd_falls_back_to_the_splitter(tmp_path, monkeypatch, body, said):
    monkeypatch.setattr(coacd_process, "is_installed", lambda: True)
    monkeypatch.setattr(coacd_process, "run_coacd", worker_that(tmp_path, body))
    made = decompose(ELL, "coacd", time_limit=0.5 if "sleep" in body else 300.0)
    assert made.method_used == "split"
    assert len(made.hulls) == 2
    assert any(said in note for note in made.notes)


def test_without_coacd_the_splitter_runs_with_a_note(monkeypatch):
    monkeypatch.setattr(coacd_process, "is_installed", lambda: False)
    made = decompose(ELL, "coacd")
    assert made.method_used == "split"
    assert any('pip install "coacd' in note for note in made.notes)
    # once it is installed the answer may differ, so this one is not kept
    assert not decompose(ELL, "coacd").cached


def test_coacd_in_its_own_process():
    pytest.importorskip("coacd")
    made = decompose(ELL, "coacd", hull_count=4, time_limit=300.0)
    assert made.method_used == "coacd"
    assert 2 <= len(made.hulls) <= 4
    assert made.excess < 0.3


def test_splitter_parts_are_kept_where_they_fit_clearly_better(monkeypatch):
    monkeypatch.setattr(coacd_process, "is_installed", lambda: True)
    poor = [CHANNEL.vertices, ELL.vertices]  # as if CoACD had left the channel in one part
    monkeypatch.setattr(coacd_process, "run_coacd", lambda *_: poor)
    made = decompose(CHANNEL, "coacd")
    assert made.method_used == "split" and made.excess < 0.05
    assert any("box splitter's parts kept" in note for note in made.notes)


def test_timeout_is_cached(tmp_path, monkeypatch):
    monkeypatch.setattr(coacd_process, "is_installed", lambda: True)
    monkeypatch.setattr(coacd_process, "run_coacd", worker_that(tmp_path, "import time; time.sleep(60)"))
    assert not decompose(ELL, "coacd", time_limit=0.3).cached
    assert decompose(ELL, "coacd", time_limit=0.3).cached


def test_meshes_share_one_total_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(coacd_process, "is_installed", lambda: True)
    monkeypatch.setattr(coacd_process, "run_coacd", worker_that(tmp_path, "import time; time.sleep(60)"))
    began = time.monotonic()
    meshes = [boxes([[0, 0, 0], [k, 0.1, 0.1]], [[0, 0.1, 0], [0.1, k, 0.1]]) for k in (0.3, 0.4, 0.5, 0.6)]
    made = decompose_many(meshes, "coacd", workers=2, time_limit=50.0, total_limit=0.5)
    assert time.monotonic() - began < 40.0
    assert [m.method_used for m in made] == ["split"] * 4
    assert any("no time was left" in note for m in made for note in m.notes)


def test_many_keep_their_order_and_report_progress():
    seen = []
    meshes = [ELL, mesh_of(trimesh.creation.box((1, 1, 1))), CHANNEL]
    made = decompose_many(meshes, "split", workers=2, progress=lambda i, done, result: seen.append((i, done)))
    assert [len(m.hulls) for m in made] == [2, 1, len(decompose(CHANNEL, "split").hulls)]
    assert sorted(i for i, _ in seen) == [0, 1, 2]
    assert [done for _, done in seen] == [1, 2, 3]


def test_interrupt_ends_the_child_processes(tmp_path, monkeypatch):
    marker = tmp_path / "pid"
    body = f"import os, time; open({str(marker)!r}, 'w').write(str(os.getpid())); time.sleep(60)"
    monkeypatch.setattr(coacd_process, "is_installed", lambda: True)
    monkeypatch.setattr(coacd_process, "run_coacd", worker_that(tmp_path, body))

    def interrupt(index, done, result):
        while not marker.exists() or not marker.read_text():
            pass
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        decompose_many([ELL, mesh_of(trimesh.creation.box((1, 1, 1)))], "coacd", progress=interrupt)
    with pytest.raises(ProcessLookupError):
        os.kill(int(marker.read_text()), 0)


def test_invalid_settings_raise():
    with pytest.raises(ConfigError, match="did you mean 'coacd'"):
        decompose(ELL, "coacdd")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="at least 1"):
        decompose(ELL, hull_count=0)
    with pytest.raises(ConfigError, match="at least 4"):
        decompose(ELL, max_vertices=3)


def test_stop_ends_the_cutting():
    grid = voxelize(CHANNEL)
    assert len(split_convex(CHANNEL, grid, 8, stop=lambda: True)) == 1


def test_clipping_a_triangle_to_a_box():
    triangle = np.array([[[-1.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    got = clip_triangles(triangle, np.array([0.0, -1, -1]), np.array([2.0, 0.5, 1]))
    expected = {(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.5, 0.5, 0.0), (0.0, 0.5, 0.0)}
    assert set(map(tuple, np.round(got, 9).tolist())) == expected
    assert len(clip_triangles(triangle, np.array([3.0, 3, 3]), np.array([4.0, 4, 4]))) == 0


def test_slice_extremes_are_running_maxima():
    rng = np.random.default_rng(0)
    reach, index = rng.random((60, 5)), rng.integers(0, 7, 60)
    index[:7] = np.arange(7)
    below, above = slice_extremes(reach, index, 7)
    for k in range(7):
        assert (
            np.take_along_axis(reach, below[k : k + 1], 0)[0].tolist()
            == reach[index <= k].max(axis=0).tolist()
        )
        assert (
            np.take_along_axis(reach, above[k : k + 1], 0)[0].tolist()
            == reach[index >= k].max(axis=0).tolist()
        )


def test_own_parts_do_not_wait_for_coacd_which_starts_with_the_largest_excess(monkeypatch):
    calls, released = [], threading.Event()

    def run_coacd(mesh, *_):
        calls.append(mesh)
        released.wait(20.0)
        raise coacd_process.CoacdFailedError("simulated failure")

    monkeypatch.setattr(coacd_process, "is_installed", lambda: True)
    monkeypatch.setattr(coacd_process, "run_coacd", run_coacd)
    torus = mesh_of(trimesh.creation.torus(0.2, 0.05))
    started = []

    def split(mesh, *args, **options):
        started.append(mesh)
        if len(started) == 3:
            released.set()
        return split_convex(mesh, *args, **options)

    monkeypatch.setattr("roboyard.shapes.convex.decomposition.split_convex", split)
    small = TriangleMesh(vertices=ELL.vertices * 0.1, faces=ELL.faces)
    # CoACD runs for the torus while the others are being split; then for the larger excess volume
    made = decompose_many([small, ELL, torus], "coacd", workers=2)
    assert len(started) == 3 and [m.method_used for m in made] == ["split"] * 3
    assert [mesh is torus for mesh in calls] == [True, False, False]
    assert calls[1] is ELL and calls[2] is small
