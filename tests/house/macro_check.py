"""The seams' headers define no macro of torch, GL, EGL or MuJoCo, whatever they include on the way.

Usage: macro_check.py ROOT COMPILER [compiler arguments ...]
"""

import re
import subprocess
import sys

SEAMS = ["render/renderer.h", "recorder/world.h", "policy/flow_trace.h", "policy/policy.h", "policy/trainer.h", "web/server.h"]
FOREIGN = re.compile(r"^#define ((?:GL_|EGL_|mj[A-Z]|TORCH_|AT_|C10_)\w*)", re.MULTILINE)


def macros_after(compiler, root, header):
    done = subprocess.run(
        [*compiler, f"-I{root}", "-x", "c++", "-E", "-dM", "-"],
        input=f'#include "{header}"\n', capture_output=True, text=True,
    )
    if done.returncode != 0:
        raise SystemExit(f"{header} cannot be read alone:\n{done.stderr}")
    return done.stdout


def main():
    root, compiler = sys.argv[1], sys.argv[2:]
    leaks = {header: FOREIGN.findall(macros_after(compiler, root, header)) for header in SEAMS}
    for header, names in leaks.items():
        print(f"{header} leaks {len(names)} macros: {', '.join(names[:5])}" if names else f"{header} leaks none")
    return 1 if any(leaks.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
