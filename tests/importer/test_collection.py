"""Whole collections: a robot that hangs or dies costs only itself; a killed run continues where it was."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from roboyard.assets import asset_path
from roboyard.errors import ConfigError
from roboyard.importer.collection import pool
from roboyard.importer.collection.run import import_collection
from roboyard.importer.collection.tasks import TaskResult, named_files

WORKER = """
import json, os, sys, time
from pathlib import Path
for line in sys.stdin:
    task = json.loads(line)
    name = task["name"]
    with open(Path(task["out"], "order.txt"), "a") as log:
        log.write(f"{name} {task['overwrite']}\\n")
    if name.startswith("hangs"):
        time.sleep(60)
    if name.startswith("dies"):
        os._exit(3)
    time.sleep(0.2 if name.startswith("slow") else 0)
    facts = {"links": 1, "joints": 0, "gates": [2, 3], "picture": None, "report": None}
    outcome = "refused" if name.startswith("bad") else "imported"
    result = {"name": name, "shown": task["shown"], "outcome": outcome, "facts": facts}
    print("roboyard-result " + json.dumps(result), flush=True)
"""
URDF = '<robot name="r"><link name="base"/></robot>'


@pytest.fixture
def worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    script = tmp_path / "worker.py"
    script.write_text(WORKER)
    monkeypatch.setattr(pool, "COMMAND", (sys.executable, str(script)))
    return script


def collection(folder: Path, *names: str) -> Path:
    place = folder / "robots"
    place.mkdir()
    for name in names:
        (place / f"{name}.urdf").write_text(URDF)
    return place


def test_files_of_one_name_get_those_of_their_folders(tmp_path: Path) -> None:
    for part in ("a/arm.urdf", "b/arm.urdf", "b/x/arm.urdf", "c/Arm 2.urdf", "arm.urdf.xacro"):
        file = tmp_path / part
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(URDF)
    names = {name: file.relative_to(tmp_path).as_posix() for name, file in named_files(tmp_path).items()}
    assert names == {
        "arm": "a/arm.urdf",
        "arm_2": "arm.urdf.xacro",
        "b_arm": "b/arm.urdf",
        "x_arm": "b/x/arm.urdf",
        "c_arm_2": "c/Arm 2.urdf",
    }


def test_a_robot_that_hangs_or_dies_costs_only_itself(tmp_path: Path, worker: Path) -> None:
    place = collection(tmp_path, "bad", "dies", "fine", "hangs", "other")
    seen: list[TaskResult] = []
    made = import_collection(
        place, out=tmp_path, jobs=2, timeout=1.5, progress=lambda result, done, count: seen.append(result)
    )
    outcomes = {result.name: result.outcome for result in made.results}
    assert outcomes == {
        "bad": "refused",
        "dies": "died",
        "fine": "imported",
        "hangs": "timed out",
        "other": "imported",
    }
    assert len(seen) == 5
    with (made.folder / "table.csv").open(newline="") as table:
        rows = list(csv.DictReader(table))
    assert [row["name"] for row in rows] == sorted(outcomes)
    assert rows[2]["gates"] == "2/3"
    page = made.page.read_text()
    assert page.count('class="one"') == 5
    assert "exit code 3" in page


def test_what_is_done_is_not_done_again(tmp_path: Path, worker: Path) -> None:
    place = collection(tmp_path, "bad", "dies", "fine", "other")
    import_collection(place, out=tmp_path, jobs=1, timeout=5)
    order = tmp_path / "order.txt"
    assert len(order.read_text().split()) == 8
    again = import_collection(place, out=tmp_path, jobs=1, timeout=5)
    assert again.reused == 4
    assert len(order.read_text().split()) == 8
    (place / "fine.urdf").write_text(URDF + "\n")
    order.unlink()
    assert import_collection(place, out=tmp_path, jobs=1, timeout=5).reused == 3
    assert order.read_text() == "fine True\n", "the package of an earlier run may be replaced"
    order.unlink()
    import_collection(place, out=tmp_path, jobs=1, timeout=5, retry=True)
    assert order.read_text() == "bad False\ndies True\n", "a refused robot's name may be another import's"


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_killed_run_continues_where_it_was(tmp_path: Path, worker: Path) -> None:
    names = [f"slow{number}" for number in range(8)]
    place = collection(tmp_path, *names)
    code = (
        "import sys\nfrom roboyard.importer.collection import pool\n"
        f"pool.COMMAND = (sys.executable, {str(worker)!r})\n"
        "from roboyard.importer.collection.run import import_collection\n"
        f"import_collection({str(place)!r}, out={str(tmp_path)!r}, jobs=1, timeout=20)\n"
    )
    run = subprocess.Popen([sys.executable, "-c", code])
    results = "*/collections/*/results/*.json"
    while len(list(tmp_path.glob(results))) < 3:
        assert run.poll() is None
        time.sleep(0.02)
    run.send_signal(signal.SIGKILL)
    run.wait()
    kept = {file.stem for file in tmp_path.glob(results)}
    assert 3 <= len(kept) < 8
    time.sleep(0.5)  # its worker ends with it
    begun = [line.split()[0] for line in (tmp_path / "order.txt").read_text().splitlines()]
    (tmp_path / "order.txt").unlink()
    made = import_collection(place, out=tmp_path, jobs=2, timeout=20)
    assert [result.outcome for result in made.results] == ["imported"] * 8
    assert made.reused == len(kept)
    again = dict(line.split() for line in (tmp_path / "order.txt").read_text().splitlines())
    assert set(again) == set(names) - kept
    for name, overwrite in again.items():
        assert (overwrite == "True") == (name in begun)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_runs_killed_at_many_moments_continue(tmp_path: Path, worker: Path) -> None:
    """Killed before the first robot, between robots and during one; no result is lost or damaged."""
    names = [f"slow{number}" for number in range(6)]
    place = collection(tmp_path, *names)
    code = (
        "import sys\nfrom roboyard.importer.collection import pool\n"
        f"pool.COMMAND = (sys.executable, {str(worker)!r})\n"
        "from roboyard.importer.collection.run import import_collection\n"
        f"import_collection({str(place)!r}, out={str(tmp_path)!r}, jobs=2, timeout=20)\n"
    )
    order, finished = tmp_path / "order.txt", 0
    for begun in (0, 1, 2, 4, 6):
        run = subprocess.Popen([sys.executable, "-c", code])
        deadline = time.monotonic() + 20
        while run.poll() is None and time.monotonic() < deadline:
            lines = order.read_text().splitlines() if order.exists() else []
            if len({line.split()[0] for line in lines}) >= begun:
                break
            time.sleep(0.01)
        run.kill()
        run.wait()
        results = [json.loads(file.read_text()) for file in tmp_path.glob("*/collections/*/results/*.json")]
        assert len(results) >= finished, "a result was lost"
        finished = len(results)
    made = import_collection(place, out=tmp_path, jobs=2, timeout=20)
    assert [result.outcome for result in made.results] == ["imported"] * 6
    assert made.reused >= finished
    assert made.page.exists()


@pytest.mark.slow
def test_the_worker_imports_and_ends_with_its_parent(tmp_path: Path) -> None:
    place = tmp_path / "robots"
    place.mkdir()
    for name in ("cube", "cartpole"):
        (place / f"{name}.urdf").write_text(asset_path(name).read_text())
    (place / "broken.urdf").write_text('<robot name="r"><link/></robot>')
    made = import_collection(place, out=tmp_path / "data", jobs=2, validate=False, report=False)
    assert {result.name: result.outcome for result in made.results} == {
        "broken": "refused",
        "cartpole": "imported",
        "cube": "imported",
    }
    facts = made.results[1].facts
    assert facts["joints"] == 2
    assert Path(facts["picture"]).stat().st_size > 1000
    assert (tmp_path / "data" / "omnigibson-robot-assets" / "models" / "cartpole").is_dir()
    idle = pool.WorkerProcess()._start()
    assert idle.stdin is not None
    idle.stdin.close()
    assert idle.wait(60) == 1


def test_wrong_arguments_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no robot file"):
        import_collection(tmp_path)
    with pytest.raises(ConfigError, match="no such folder"):
        import_collection(tmp_path / "none")
    place = collection(tmp_path, "a")
    with pytest.raises(ConfigError, match="above 0"):
        import_collection(place, out=tmp_path, jobs=0)


@pytest.mark.slow
def test_a_cluster_imports_the_same(tmp_path: Path, worker: Path) -> None:
    pytest.importorskip("ray")
    place = collection(tmp_path, "bad", "dies", "fine")
    code = (
        "from roboyard.importer.collection.run import import_collection\n"
        f"made = import_collection({str(place)!r}, out={str(tmp_path)!r}, ray='local', timeout=60,\n"
        "    validate=False, report=False)\n"
        "import json; print(json.dumps({r.name: r.outcome for r in made.results}))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300
    )
    outcomes = json.loads(done.stdout.splitlines()[-1])
    assert outcomes == {"bad": "imported", "dies": "imported", "fine": "imported"}
