"""Fuzz every reader of files from outside: URDF, SDF, MJCF, meshes, YAML, logs and wire frames.

    python tools/fuzz_readers.py [SECONDS] [--only READER ...] [--seed N] [--keep FOLDER]

Valid files and the corpus of what once broke (tests/fuzz/corpus) are changed at random and read in a child
process with 2 GiB of memory and 5 s of CPU per case. A case that ends a child, needs more, or raises anything
but Roboyard's own errors is kept; copy it to the corpus once it is fixed.
"""

from __future__ import annotations

import argparse
import importlib
import os
import random
import re
import resource
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "fuzz"))
readers: Any = importlib.import_module("readers")

MEMORY = 6 << 30
"""Address space of a child (bytes), of which libraries and LLVM reserve most."""
RESIDENT = 1200
"""Largest memory of a child (MiB)."""
CPU = 5.0
"""Longest case (s of CPU)."""
CASES = 200
"""Cases of one child."""
LONGEST = 50_000
NUMBERS = (
    *(b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e-320", b"0", b"-1", b"1", b"65535", b"2147483648"),
    *(b"4294967295", b"99999999999999999999", b"1e9", b"0x10", b"1.2.3", b"", b"-0"),
)
TEXTS = (
    *(
        b"../../../etc/passwd",
        b"/dev/zero",
        b"\0",
        b"<",
        b'"',
        b"&x;",
        b"<!--",
        b"]]>",
        b"<?xml ",
        b"$(optenv ",
    ),
    *(
        b"\xff\xfe",
        b"\xe2\x80\xae",
        b"\x1b[31m",
        b"{",
        b"[",
        b"[[[[[[[[",
        b"&a",
        b"*a",
        b"!!python/object:os.x ",
    ),
    *(b"\xff\xff\xff\xff", b"\x00\x00\x00\x00", b"\x7f\xff\xff\xff", b"\xdd\xff\xff\xff\xff", b"\x90" * 40),
)
_NUMBER = re.compile(rb"-?\d+\.?\d*(?:e-?\d+)?")
_TAG = re.compile(rb"<[a-zA-Z_]+[^<>]*/?>")
_WORD = re.compile(rb'"[^"]*"')


def changed(data: bytes, draw: random.Random) -> bytes:
    """Return the bytes with a few changes: of numbers, tags, words, bits or stretches."""
    out = bytearray(data)
    for _ in range(draw.choice((1, 1, 2, 3, 6))):
        kind = draw.randint(0, 8)
        start = draw.randint(0, len(out))
        end = min(len(out), start + draw.choice((1, 2, 4, 8, 40, 400)))
        if kind <= 2:
            found = list((_NUMBER, _TAG, _WORD)[kind].finditer(out))
            if found:
                first, second = draw.choice(found), draw.choice(found)
                new = draw.choice(NUMBERS) if kind == 0 else second[0]
                out[first.start() : first.end()] = new
        elif kind == 3:
            del out[start:end]
        elif kind == 4:
            out[start:start] = bytes(out[start:end]) * draw.choice((1, 2, 30))
        elif kind == 5:
            out[start:end] = draw.choice(TEXTS)
        elif kind == 6 and start < len(out):
            out[start] ^= 1 << draw.randint(0, 7)
        elif kind == 7:
            out[start:start] = draw.choice(TEXTS) * draw.choice((1, 1, 100))
        else:
            out[start:end] = bytes(draw.randrange(256) for _ in range(end - start))
    return bytes(out[:LONGEST])


def seeds_of(reader: str) -> list[bytes]:
    """Return the valid file and the corpus of a reader."""
    return [readers.READERS[reader][2], *(file.read_bytes() for file in readers.CORPUS.glob(f"{reader}.*"))]


def run_child(reader: str, seed: int, folder: Path) -> tuple[int, str]:
    """Read CASES cases in a child; return how many it read and the fault that ended it, if any."""
    report = folder / "report"
    report.write_text("0\n")
    child = os.fork()
    if child == 0:
        try:
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            _read_cases(reader, seed, folder, report)
        except BaseException:
            report.write_text(f"{report.read_text().splitlines()[0]}\n{traceback.format_exc()}")
            os._exit(1)
        os._exit(0)
    begin = time.monotonic()
    heard = report.stat().st_mtime_ns
    while True:
        done, status, usage = os.wait4(child, os.WNOHANG)
        if done:
            break
        time.sleep(0.02)
        now = report.stat().st_mtime_ns
        if now != heard:
            heard, begin = now, time.monotonic()
        if time.monotonic() - begin > 20 * CPU:
            os.kill(child, 9)
            os.wait4(child, 0)
            return int(report.read_text().splitlines()[0]), "hang"
    lines = report.read_text().splitlines()
    fault = "\n".join(lines[1:])
    if not fault and os.waitstatus_to_exitcode(status):
        fault = f"ended with {os.waitstatus_to_exitcode(status)}"
    if not fault and usage.ru_maxrss / 1024 > RESIDENT:
        fault = f"{usage.ru_maxrss // 1024} MiB"
    return int(lines[0] or 0), fault


def _read_cases(reader: str, seed: int, folder: Path, report: Path) -> None:
    draw, seeds = random.Random(seed), seeds_of(reader)
    for count in range(CASES):
        data = changed(draw.choice(seeds), draw)
        (folder / "current").write_bytes(data)
        report.write_text(f"{count + 1}\n")
        begin = time.process_time()
        readers.survives(reader, data, folder)
        if time.process_time() - begin > CPU:
            raise TimeoutError(f"{time.process_time() - begin:.1f} s of CPU")


def main() -> int:
    """Run for some seconds, 60 by default; return 1 where a fault was found."""
    parser = argparse.ArgumentParser()
    parser.add_argument("seconds", nargs="?", type=float, default=60.0)
    parser.add_argument("--only", nargs="*", default=list(readers.READERS))
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--keep", type=Path, default=Path("fuzz-faults"))
    given = parser.parse_args()
    seed = time.time_ns() % 2**32 if given.seed is None else given.seed
    until, counts, faults = time.monotonic() + given.seconds, dict.fromkeys(given.only, 0), 0
    while time.monotonic() < until:
        for reader in given.only:
            seed += 1
            with tempfile.TemporaryDirectory() as folder:
                count, fault = run_child(reader, seed, Path(folder))
                counts[reader] += count
                if fault:
                    faults += 1
                    given.keep.mkdir(parents=True, exist_ok=True)
                    kept = given.keep / f"{reader}.{seed}{readers.READERS[reader][0]}"
                    case = Path(folder) / "current"
                    kept.write_bytes(case.read_bytes() if case.exists() else b"")
                    kept.with_suffix(".txt").write_text(fault)
                    print(f"{kept}: {fault.splitlines()[-1][:200]}", flush=True)
            if time.monotonic() > until:
                break
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    hours = (used.ru_utime + used.ru_stime) / 3600
    print(f"{sum(counts.values())} cases in {hours:.2f} CPU hours, {faults} faults: {counts}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
