"""The files that belong to the house: what git tracks, or all but build products where there is no git."""

import pathlib
import subprocess

CHAIN = ["render", "recorder", "policy", "web", "app"]
PRODUCTS = {".git", "build", "node_modules", "dist", "flowscope-data"}


def all_files(root):
    """Paths relative to `root`, sorted; files that are tracked but deleted are left out."""
    root = pathlib.Path(root)
    listing = subprocess.run(
        ["git", "-c", "safe.directory=*", "-C", root, "ls-files", "-z"], capture_output=True, text=True
    )
    if listing.returncode == 0:
        names = [pathlib.Path(name) for name in listing.stdout.split("\0") if name]
    else:
        names = [path.relative_to(root) for path in root.rglob("*")]
        names = [name for name in names if not PRODUCTS.intersection(name.parts)]
    return sorted(name for name in names if (root / name).is_file())


def cpp_files(root):
    return [name for name in all_files(root) if name.suffix in (".h", ".cc")]
