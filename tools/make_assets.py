"""Write the bundled robots: meshes, textures and URDFs, the same bytes on every run.

python tools/make_assets.py              rewrite src/roboyard/assets, but not the finished packages
python tools/make_assets.py --check      compare it with a fresh build; exit 1 on a difference
python tools/make_assets.py --packages   rewrite the finished packages (R1's) by importing their sources
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from assets import (
    arm7,
    ground,
    husky,
    packages,
    props,
    r1,
    r2d2,
    rover,
    standin_arms,
    standin_mobile,
    standin_props,
    walker,
)

ASSETS = Path(__file__).resolve().parents[1] / "src" / "roboyard" / "assets"
GROUPS = (ground, r2d2, husky, r1, rover, arm7, walker, props, standin_arms, standin_mobile, standin_props)


def build() -> dict[str, bytes]:
    """Return every generated file by its path under the assets folder; finished packages excepted."""
    files: dict[str, bytes] = {}
    for group in GROUPS:
        files.update(group.build())
    return dict(sorted(files.items()))


def is_definition(path: Path) -> bool:
    """Return whether a file is a robot definition (`<name>/<name>.yaml`), which is written by hand."""
    return path.suffix == ".yaml" and path.stem == path.parent.name


def differences(root: Path, files: dict[str, bytes]) -> list[str]:
    """List the files under `root` that are missing, stale or not generated; one line each.

    Finished packages are compared among themselves: only where `files` holds one of their files.
    """
    of_package = any(packages.is_package_file(Path(name)) for name in files)
    found = {
        p.relative_to(root).as_posix(): p
        for p in root.rglob("*")
        if p.is_file() and p.suffix != ".py" and "__pycache__" not in p.parts and not is_definition(p)
        if packages.is_package_file(p.relative_to(root)) == of_package
    }
    lines = [f"missing: {name}" for name in files if name not in found]
    lines += [f"not generated: {name}" for name in sorted(found) if name not in files]
    lines += [f"differs: {n}" for n, data in files.items() if n in found and found[n].read_bytes() != data]
    return lines


def write(root: Path, files: dict[str, bytes]) -> None:
    """Write the files and remove generated ones that are no longer made."""
    for line in differences(root, files):
        if line.startswith("not generated: "):
            (root / line.removeprefix("not generated: ")).unlink()
    for name, data in files.items():
        target = root / name
        if not target.exists() or target.read_bytes() != data:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="compare instead of writing")
    parser.add_argument("--packages", action="store_true", help="the finished packages instead")
    parser.add_argument("--out", type=Path, default=ASSETS, help="another assets folder")
    args = parser.parse_args()
    files = packages.build() if args.packages else build()
    if args.check:
        problems = differences(args.out, files)
        print("\n".join(problems) or f"{len(files)} files are as generated")
        return 1 if problems else 0
    write(args.out, files)
    print(f"{len(files)} files, {sum(map(len, files.values())) / 1e6:.2f} MB in {args.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
