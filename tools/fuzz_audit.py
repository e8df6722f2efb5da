"""Fuzz the audit and the repair of URDF files, guided by coverage where atheris is installed.

    python tools/fuzz_audit.py [SECONDS]

Atheris is not a dependency (`pip install atheris`); without it bytes are changed at random, from a new seed
each time. A file that breaks an invariant of `tests/audit/test_fuzz.py` is kept as `fuzz-crash.urdf`.
"""

from __future__ import annotations

import importlib
import random
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "audit"))

WORDS = (
    b"nan",
    b"1e308",
    b"1e-320",
    b"-1",
    b"0",
    b"../",
    b"\0",
    b"<",
    b'"',
    b"&x;",
    b"package://",
    b"<link/>",
)
LONGEST = 20_000
"""Bytes of a case."""


def _invariants() -> Any:
    """The test's module, which is in no package."""
    return importlib.import_module("test_fuzz")


def changed(data: bytes, draw: random.Random) -> bytes:
    """Return the bytes with a few removed, doubled or overwritten."""
    out = bytearray(data)
    for _ in range(draw.randint(1, 6)):
        start = draw.randint(0, len(out))
        end = min(len(out), start + draw.randint(0, 40))
        match draw.randint(0, 2):
            case 0:
                del out[start:end]
            case 1:
                out[start:start] = out[start:end]
            case _:
                out[start:end] = draw.choice(WORDS)
    return bytes(out[:LONGEST])


def attempt(data: bytes) -> None:
    """Check the invariants for one case; keep it where it breaks them."""
    try:
        _invariants().survives(data)
    except Exception:
        Path("fuzz-crash.urdf").write_bytes(data)
        raise


def main() -> None:
    """Run for some seconds, 60 by default."""
    seconds = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    try:
        atheris: Any = importlib.import_module("atheris")
    except ImportError:
        seeds, seed = _invariants().SEEDS, time.time_ns()
        draw, until, count = random.Random(seed), time.monotonic() + seconds, 0
        print(f"atheris is not installed; random changes from seed {seed}")
        while time.monotonic() < until:
            attempt(changed(draw.choice(seeds).encode(), draw))
            count += 1
        print(f"{count} cases, no fault")
        return
    with atheris.instrument_imports(include=["roboyard"]):
        seeds = _invariants().SEEDS
    options = (f"-max_total_time={seconds}", f"-max_len={LONGEST}", "-len_control=0")

    def mutated(data: bytes, size: int, seed: int) -> bytes:
        """Return a mutation of the fuzzer's input, or of a whole robot where that is short and at random."""
        draw = random.Random(seed)
        known = data if len(data) > 100 and draw.random() < 0.8 else draw.choice(seeds).encode()
        return changed(known, draw)[:size]

    atheris.Setup([sys.argv[0], *options], attempt, custom_mutator=mutated)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
