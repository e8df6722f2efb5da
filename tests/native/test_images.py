"""Images of object files: what is loaded without LLVM does the same as what LLVM loads."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from roboyard.native.images import Image, image_from_bytes, image_of
from roboyard.native.memory import images_can_be_loaded, load_image

pytestmark = pytest.mark.skipif(not images_can_be_loaded(), reason="images are for x86-64 Linux")

LOOPS = """
import sys

import numpy as np

from roboyard.native import compiled, objects

TABLE = (0.1, 0.7, 1.9, 3.1)

if "--llvm" in sys.argv:
    objects.images_can_be_loaded = lambda: False


@compiled("f8[:,:] f8[::1] i8 -> f8", fast_math=True)
def mixed(given, out, power):
    for k in range(out.shape[0]):
        grown = np.exp(given[k, 0]) ** power
        out[k] = np.sin(given[k, 1]) + grown + TABLE[k % 4] * np.arctan2(given[k, 0], 2.0)
    return np.sqrt(out.sum())


if __name__ == "__main__":
    given, out = np.linspace(-1.0, 2.0, 40).reshape(20, 2)[:, ::-1], np.zeros(20)
    total = mixed(given, out, 3)
    print(total.hex(), out.tobytes().hex())
    print("numba" in sys.modules, "llvmlite.binding" in sys.modules)
"""


def run(folder: Path, *arguments: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "loops.py", *arguments],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**os.environ, "NUMBA_CACHE_DIR": str(folder / f"cache{len(arguments)}")},
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_an_image_gives_the_numbers_of_the_object_file_to_the_last_bit(tmp_path: Path) -> None:
    (tmp_path / "loops.py").write_text(LOOPS)
    built, loaded = run(tmp_path), run(tmp_path)
    assert loaded == [built[0], "False False"]
    run(tmp_path, "--llvm")
    assert run(tmp_path, "--llvm") == [built[0], "False True"]


def object_file(text: str) -> bytes:
    llvm = pytest.importorskip("llvmlite.binding")
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_triple("x86_64-unknown-linux-gnu")
    machine = target.create_target_machine(reloc="pic", codemodel="small")
    return machine.emit_object(llvm.parse_assembly(text))


def test_object_files_with_variables_have_no_image() -> None:
    plain = object_file("define i64 @f(i64 %a) { ret i64 %a }")
    image = image_of(plain, "f")
    assert image is not None and image_from_bytes(image.to_bytes()) == image
    assert image_of(plain, "g") is None
    variable = object_file("""
        @v = internal global i64 3
        define i64 @f(i64 %a) {
            %old = atomicrmw add ptr @v, i64 %a seq_cst
            ret i64 %old
        }
    """)
    assert image_of(variable, "f") is None


def test_an_image_that_needs_an_unknown_function_is_not_loaded() -> None:
    assert load_image(Image(bytes(16), 0, (), ((8, "no_function_of_this_name"),))) == 0
