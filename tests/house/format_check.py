"""Every C++ file is formatted by .clang-format."""

import subprocess
import sys

from sources import cpp_files


def main():
    root = sys.argv[1]
    names = cpp_files(root)
    if not names:
        print("no file was looked at")
        return 1
    checked = subprocess.run(["clang-format", "--dry-run", "-Werror", *names], cwd=root, stderr=subprocess.PIPE, text=True)
    if checked.returncode != 0:
        complaints = [line for line in checked.stderr.splitlines() if "error:" in line]
        print("\n".join(complaints))
        print("clang-format -i mends the files named above")
        return 1
    print(f"{len(names)} files are formatted")
    return 0


if __name__ == "__main__":
    sys.exit(main())
