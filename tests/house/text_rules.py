"""Rules that no compiler checks: file length, line ends, stray markers."""

import pathlib
import sys

from sources import all_files

MAX_LINES = 400
# Longer files, each for a reason that was agreed on.
LONGER = {}
TEXT = {".h", ".cc", ".py", ".ts", ".css", ".html", ".md", ".txt", ".yaml", ".xml", ".cmake"}
COUNTED = {".h", ".cc", ".py", ".ts"}
MARKERS = ("TO" + "DO", "FIX" + "ME", "<<<<" + "<<<", ">>>>" + ">>>")


def problems_of(root, name):
    path = root / name
    if path.suffix not in TEXT:
        return
    data = path.read_bytes()
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        yield f"{name}: not UTF-8"
        return
    lines = text.splitlines()
    if name.suffix in COUNTED and len(lines) > LONGER.get(name.as_posix(), MAX_LINES):
        yield f"{name}: {len(lines)} lines; split it, or list it here with the reason"
    if "\r" in text:
        yield f"{name}: has carriage returns"
    if text and not text.endswith("\n"):
        yield f"{name}: the last line does not end"
    for number, line in enumerate(lines, 1):
        for marker in MARKERS:
            if marker in line:
                yield f"{name}:{number}: {marker}"
        if line != line.rstrip() and name.suffix != ".md":
            yield f"{name}:{number}: blanks at the end of the line"


def main():
    root = pathlib.Path(sys.argv[1])
    names = all_files(root)
    problems = [problem for name in names for problem in problems_of(root, name)]
    print("\n".join(problems) or f"{len(names)} files are in order")
    return 1 if problems or not names else 0


if __name__ == "__main__":
    sys.exit(main())
