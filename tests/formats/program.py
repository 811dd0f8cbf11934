"""Calls the program under test, whose path is the first argument, and reads what it wrote with stand-ins of its readers."""

import pickle
import subprocess
import sys
import types

PROGRAM = sys.argv.pop(1)


def call(*words):
    return subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True)


def flowscope(*words):
    done = call(*words)
    if done.returncode:
        raise AssertionError(f"{words}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def load_rlbench_demo(path):
    """The two classes that RLBench brings, standing in for it."""
    for name in ("rlbench", "rlbench.demo", "rlbench.backend", "rlbench.backend.observation"):
        sys.modules[name] = types.ModuleType(name)
    sys.modules["rlbench.demo"].Demo = type("Demo", (), {})
    sys.modules["rlbench.backend.observation"].Observation = type("Observation", (), {})
    return pickle.loads(path.read_bytes())
