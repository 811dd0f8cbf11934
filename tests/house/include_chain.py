"""Who may include whom.

A folder includes only from itself and the folders to its left: render <- recorder <- policy <- web <- app. Each folder
leaves some libraries alone. And a header that another folder uses brings no torch, GL, EGL or MuJoCo along.
"""

import pathlib
import re
import sys

from sources import CHAIN, cpp_files

HOUSE = re.compile(r'^\s*#\s*include\s+"((?:%s|tests)/[^"]+)"' % "|".join(CHAIN))
LIBRARY = re.compile(r"^\s*#\s*include\s+[<\"]([A-Za-z0-9_-]+)[./]")
FORBIDDEN = {
    "render": {"torch", "ompl", "boost", "nlohmann", "yaml-cpp"},
    "recorder": {"torch", "boost", "EGL", "GL"},
    "policy": {"mujoco", "EGL", "GL", "boost", "ompl"},
    "web": {"torch", "mujoco", "EGL", "GL"},
    "app": set(),
}
MACRO_FLOODS = {"torch", "ATen", "c10", "GL", "EGL", "mujoco", "hdf5", "png", "minizip"}
# The readers and writers of files that hold JSON by their layout, outside web and app.
JSON_READERS = {
    "recorder/demo_header.cc", "recorder/formats/robomimic_file.cc", "recorder/mesh/gltf_extensions.h", "recorder/mesh/gltf_file.h", "policy/checkpoint.cc", "policy/container.cc", "policy/safetensors.cc", "policy/weights_io.cc",
}


class Source:
    def __init__(self, root, name):
        self.name, self.folder = name.as_posix(), name.parts[0]
        self.house, self.libraries = [], []
        for number, line in enumerate((root / name).read_text(encoding="utf-8").splitlines(), 1):
            if match := HOUSE.match(line):
                self.house.append((number, match[1]))
            elif match := LIBRARY.match(line):
                self.libraries.append((number, match[1]))


def chain_problems(source, known):
    allowed = CHAIN[: CHAIN.index(source.folder) + 1]
    for number, header in source.house:
        place = f"{source.name}:{number}"
        if header.split("/")[0] not in allowed:
            yield f"{place}: {source.folder} must not include {header}"
        elif header not in known:
            yield f"{place}: {header} does not exist"
    for number, library in source.libraries:
        place = f"{source.name}:{number}"
        if library in FORBIDDEN[source.folder]:
            yield f"{place}: {source.folder} must not use {library}"
        if library == "nlohmann" and source.folder in ("recorder", "policy") and source.name not in JSON_READERS:
            yield f"{place}: JSON stays in web, app and the readers of files with a JSON header"


def path_to_flood(header, known, seen):
    """How `header` reaches a library that floods its users with macros, as text; None when it does not."""
    seen.add(header)
    source = known.get(header)
    if source is None:
        return None
    for _, library in source.libraries:
        if library in MACRO_FLOODS:
            return f"{header} -> {library}"
    for _, included in source.house:
        if included not in seen and (path := path_to_flood(included, known, seen)):
            return f"{header} -> {path}"
    return None


def leak_problems(sources, known):
    for source in sources:
        for number, header in source.house:
            if header.split("/")[0] != source.folder and (path := path_to_flood(header, known, set())):
                yield f"{source.name}:{number}: a header that another folder uses leaks macros: {path}"


def main():
    root = pathlib.Path(sys.argv[1])
    sources = [Source(root, name) for name in cpp_files(root) if name.parts[0] in CHAIN]
    known = {source.name: source for source in sources}
    problems = [problem for source in sources for problem in chain_problems(source, known)]
    problems += leak_problems(sources, known)
    print("\n".join(problems) or f"{len(sources)} files keep to the chain")
    return 1 if problems or not sources else 0


if __name__ == "__main__":
    sys.exit(main())
