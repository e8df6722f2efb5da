"""Imports killed or interrupted, at ten random moments each: what is there is always a whole package.

A process with everything loaded forks a child for each import; the child counts what it does to the file
system and sends itself the signal at the chosen count, so that moments lie all over the run and come again.
"""

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import roboyard
from roboyard.description import load_description
from roboyard.importer.package import PackageFolders, building

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")

URDF = """<robot name="pair"><link name="base"><inertial><mass value="{mass}"/>
<inertia ixx=".1" ixy="0" ixz="0" iyy=".1" iyz="0" izz=".1"/></inertial>
<visual><geometry><box size=".3 .3 .1"/></geometry></visual>
<collision><geometry><box size=".3 .3 .1"/></geometry></collision></link>
<link name="tip"><inertial><mass value="1"/>
<inertia ixx=".01" ixy="0" ixz="0" iyy=".01" iyz="0" izz=".01"/></inertial>
<visual><geometry><sphere radius="0.1"/></geometry></visual></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="tip"/><origin xyz="0 0 0.3"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="20" velocity="2"/></joint></robot>"""
NEVER = 10**9

FORKER = """
import os, signal, sys
from roboyard import import_robot
from roboyard.errors import RoboyardError

WATCHED = {"open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "shutil.copytree", "shutil.rmtree",
           "shutil.move", "ctypes.dlsym"}

def run(urdf, data, at, number, tally):
    done = 0
    def watch(event, arguments):
        nonlocal done
        if event in WATCHED and (event != "open" or data in str(arguments[0])):
            done += 1
            if done == at:
                os.kill(os.getpid(), number)
    sys.addaudithook(watch)
    try:
        import_robot(urdf, out=data, name="pair", overwrite=True, validate=False)
    finally:
        if tally != "-":
            with os.fdopen(os.open(tally, os.O_CREAT | os.O_WRONLY), "w") as file:
                file.write(str(done))

run(*sys.argv[1:3], 0, 0, "-")  # everything is loaded and compiled now
print("ready", flush=True)
for line in sys.stdin:
    urdf, data, at, number, tally = line.rstrip("\\n").split("\\t")
    child = os.fork()
    if child == 0:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        status = 0
        try:
            run(urdf, data, int(at), int(number), tally)
        except KeyboardInterrupt:
            status = 130
        finally:
            os._exit(status)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


class Importer:
    """Imports by forked children."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.data = folder, folder / "data"
        environment = dict(os.environ, PYTHONPATH=str(Path(roboyard.__file__).parents[1]))
        environment["ROBOYARD_CACHE"] = str(folder / "cache")
        first = self.urdf(1.0)
        self.process = subprocess.Popen(
            [sys.executable, "-W", "ignore", "-c", FORKER, str(first), str(folder / "warm")],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        assert self.process.stdout.readline() == "ready\n"

    def urdf(self, mass: float) -> Path:
        file = self.folder / f"pair{mass:g}.urdf"
        file.write_text(URDF.format(mass=mass))
        return file

    def run(self, mass: float, at: int = NEVER, number: int = signal.SIGKILL, tally: Path | str = "-") -> int:
        words = (self.urdf(mass), self.data, at, int(number), tally)
        self.process.stdin.write("\t".join(map(str, words)) + "\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())

    def close(self) -> None:
        self.process.stdin.close()
        self.process.wait(10)
        self.process.stdout.close()


@pytest.fixture(scope="module")
def importer(tmp_path_factory):
    made = Importer(tmp_path_factory.mktemp("cut"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def count(importer) -> int:
    """How often an import over an old one touches the data folder."""
    assert importer.run(1.0) == 0
    tally = importer.folder / "tally"
    assert importer.run(2.0, tally=tally) == 0
    assert importer.run(1.0) == 0
    return int(tally.read_text())


def state(folder: Path) -> dict[str, str]:
    """Hash of each file that says nothing of the time it was made."""
    assert json.loads((folder / "import_log.json").read_text())["seconds"]
    assert (folder / "import_report.html").read_text().endswith("</body></html>\n")
    timed = ("import_log.json", "import_report.html")
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in timed
    }


def states(importer) -> tuple[dict[str, str], ...]:
    place = PackageFolders(data=importer.data, dataset="omnigibson-robot-assets", name="pair")
    return state(place.object), state(place.model)


def leftovers(importer) -> list[Path]:
    return [p for p in (importer.data / "omnigibson-robot-assets").glob(".import-*") if p.is_dir()]


def moments(count: int, seed: int, last: int = 3) -> list[int]:
    """Ten, one in each tenth of the run but for the `last`, which lie among the moves at its end."""
    rng = random.Random(seed)
    early = [
        rng.randint(1 + k * count // (10 - last), (k + 1) * count // (10 - last)) for k in range(10 - last)
    ]
    return early + rng.sample(range(count - 14, count + 1), last)


@pytest.mark.slow
def test_ten_kills_leave_a_whole_package(importer, count):
    wholes = {}
    for mass in (2.0, 1.0):
        assert importer.run(mass) == 0
        wholes[mass] = states(importer)
    assert count > 60 and wholes[1.0] != wholes[2.0]
    at, killed = moments(count, seed=5), 0
    for index, moment in enumerate(at):
        new = 1.0 + (index + 1) % 2
        killed += importer.run(new, moment, signal.SIGKILL) == -signal.SIGKILL
        for part, olds in zip(states(importer), zip(*wholes.values(), strict=True), strict=True):
            assert part in olds, f"killed at {moment} of {count}"
        load_description(importer.data / "omnigibson-robot-assets/models/pair/urdf/pair.urdf")
    assert killed == 10
    assert importer.run(2.0) == 0
    assert states(importer) == wholes[2.0]
    assert leftovers(importer) == []


@pytest.mark.slow
def test_ten_interrupts_leave_the_old_package_or_the_new_one(importer, count):
    wholes = {}
    for mass in (2.0, 1.0):
        assert importer.run(mass) == 0
        wholes[mass] = states(importer)
    stopped = 0
    for moment in moments(count, seed=6):
        stopped += importer.run(2.0, moment, signal.SIGINT) == 130
        assert states(importer) in wholes.values(), f"interrupted at {moment} of {count}"
        assert leftovers(importer) == []
        if states(importer) == wholes[2.0]:
            assert importer.run(1.0) == 0
    assert stopped >= 8  # one that arrives where Python cannot raise lets the import go on


@pytest.mark.parametrize("cut", ["exchange", "rename", "second"])
def test_a_move_cut_short_is_finished_by_the_next_import(tmp_path, monkeypatch, cut):
    """Whichever of its steps was the last: both folders are the new ones afterwards."""
    from roboyard.importer import package

    place = PackageFolders(data=tmp_path, dataset="set", name="pair")

    def fill(build: Path, text: str) -> None:
        for part in ("object", "model"):
            (build / part / "file").write_text(text)

    with building(place, overwrite=False) as build:
        fill(build, "old")
    real_put, real_exchange, puts = package._put, package._exchange, []

    def put(part: Path, target: Path) -> None:
        puts.append(part)
        if cut == "second" and len(puts) > 1:
            os._exit(9)
        real_put(part, target)

    def exchange(a: Path, b: Path) -> bool:
        done = cut != "rename" and real_exchange(a, b)
        if cut == "exchange":
            os._exit(9)
        if cut == "rename":
            b.rename(a.with_name(f"{a.name}.old"))
            os._exit(9)
        return done

    monkeypatch.setattr(package, "_put", put)
    monkeypatch.setattr(package, "_exchange", exchange)
    child = os.fork()
    if child == 0:
        with building(place, overwrite=True) as build:
            fill(build, "new")
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 9
    monkeypatch.undo()
    with pytest.raises(roboyard.RoboyardError, match="exists already"), building(place, overwrite=False):
        pass
    assert (place.object / "file").read_text() == (place.model / "file").read_text() == "new"
    assert not [p for p in place.root.glob(".import-*") if p.is_dir()]


@pytest.mark.parametrize(
    "content",
    ["", "not json", "[]", '{"object": 1}', '{"object": "a", "model": 2}', "[" * 5000, "1" * 100_000],
)
def test_a_mark_that_is_empty_or_cut_counts_as_none(tmp_path: Path, content: str) -> None:
    """An empty mark is what a power failure can leave; it blocked the robot's name."""
    place = PackageFolders(data=tmp_path, dataset="set", name="pair")
    left = place.root / ".import-pair-left"
    (left / "object").mkdir(parents=True)
    (left / "ready").write_text(content)
    with building(place, overwrite=False) as build:
        (build / "object" / "new").touch()
    assert (place.object / "new").exists()
    assert place.model.is_dir()
    assert not left.exists()


def test_a_reader_finishes_a_move_cut_short(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A kill between the two exchanges leaves halves of two imports; no reader of the folder sees them."""
    from roboyard import whole_moves
    from roboyard.importer import package
    from roboyard.robots.registry import Registry

    place = PackageFolders(data=tmp_path, dataset="set", name="pair")

    def fill(build: Path, text: str) -> None:
        for part in ("object", "model"):
            (build / part / "pair.yaml").write_text(text)

    with building(place, overwrite=False) as build:
        fill(build, "old")

    def killed(a: Path, b: Path) -> bool:
        whole_moves.exchange(a, b)
        os._exit(9)

    monkeypatch.setattr(package, "_exchange", killed)
    child = os.fork()
    if child == 0:
        with building(place, overwrite=True) as build:
            fill(build, "new")
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 9
    texts = [(folder / "pair.yaml").read_text() for folder in (place.object, place.model)]
    assert texts == ["new", "old"]
    with whole_moves.locked(place.root, "pair") as is_ours:
        assert is_ours
        assert "pair" in Registry(tmp_path)  # another process is at it: nothing is done
        assert (place.model / "pair.yaml").read_text() == "old"
    assert "pair" in Registry(tmp_path)
    assert (place.model / "pair.yaml").read_text() == "new"


def test_a_mark_is_made_after_its_parts_are_on_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from roboyard import whole_moves

    (tmp_path / "object" / "deep").mkdir(parents=True)
    (tmp_path / "model").mkdir()
    (tmp_path / "object" / "deep" / "file").write_text("x")
    synced: list[str] = []

    def fsync(handle: int) -> None:
        assert not (tmp_path / whole_moves.READY).exists() or synced[-1] == "ready.draft"
        synced.append(Path(f"/proc/self/fd/{handle}").readlink().name)

    monkeypatch.setattr(os, "fsync", fsync)
    whole_moves.mark_ready(tmp_path)
    assert synced.index("file") < synced.index("ready.draft") == len(synced) - 2
    assert synced[-1] == tmp_path.name
