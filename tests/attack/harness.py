"""The real server as a process of its own, and what a client needs to press it. Standard library only."""

import argparse
import http.client
import json
import os
import re
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time


class Server:
    """`flowscope serve` on a free port with an empty data folder, ended when the block ends."""

    def __init__(self, program, *options, task="push_buttons", environment=None, preexec=None):
        self.data = tempfile.mkdtemp(prefix="flowscope-attack-")
        self.log = open(os.path.join(self.data, "serve.txt"), "w+")
        words = [program, "serve", "--port", "0", "--data", self.data]
        if "--scene" not in options:
            words += ["--task", task]
        self.process = subprocess.Popen(
            words + list(options), stdout=subprocess.PIPE, stderr=self.log, text=True,
            env={**os.environ, **(environment or {})}, preexec_fn=preexec)
        line = self.line = self.process.stdout.readline()
        found = re.search(r"http://([^:/]+):(\d+)/\S*?(?:token=(\w+))?$", line.strip())
        if not found:
            self.process.wait(30)
            raise RuntimeError("serve did not start: " + line + self.messages())
        self.host, self.port, self.token = found[1], int(found[2]), found[3] or ""
        self.wait_for(lambda: self.call("GET", "/health")[0] == 200, 60, "the server is ready")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.log.close()
        shutil.rmtree(self.data, ignore_errors=True)

    def messages(self):
        with open(self.log.name) as file:
            return file.read()

    def call(self, method, path, body=None, timeout=60, headers=None):
        """(status, decoded JSON or bytes). `body` is a value to be sent as JSON, or bytes as they are."""
        connection = http.client.HTTPConnection(self.host, self.port, timeout=timeout)
        try:
            raw = body if isinstance(body, (bytes, type(None))) else json.dumps(body).encode()
            connection.request(method, path, raw, {"Authorization": "Bearer " + self.token,
                                                   "Content-Type": "application/json", **(headers or {})})
            answer = connection.getresponse()
            content = answer.read()
            if "json" in (answer.getheader("Content-Type") or "") and content:
                return answer.status, json.loads(content)
            return answer.status, content
        finally:
            connection.close()

    def job(self, identifier, timeout=120):
        """Waits for the end of a job and returns its last status."""
        last = {}

        def ended():
            last.update(self.call("GET", "/api/v1/jobs/" + identifier)[1])
            return last["state"] in ("done", "failed", "cancelled")

        self.wait_for(ended, timeout, "job " + identifier + " ends")
        return last

    def socket(self, timeout=10):
        return socket.create_connection((self.host, self.port), timeout=timeout)

    def resident_mb(self):
        with open(f"/proc/{self.process.pid}/smaps_rollup") as file:
            return int(re.search(r"^Rss:\s+(\d+)", file.read(), re.M)[1]) / 1024

    def threads(self):
        return len(os.listdir(f"/proc/{self.process.pid}/task"))

    def terminate(self, timeout=30):
        """SIGTERM; returns (exit code, seconds until the process was gone)."""
        begin = time.monotonic()
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(timeout)
        return code, time.monotonic() - begin

    @staticmethod
    def wait_for(condition, timeout, what):
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                raise AssertionError(f"not within {timeout} s: {what}")
            time.sleep(0.02)


def side_by_side(calls):
    """Runs every call on a thread of its own; returns their results in order. What one throws is its result."""
    results = [None] * len(calls)

    def run(index):
        try:
            results[index] = calls[index]()
        except Exception as error:  # the caller decides what a failed call means
            results[index] = error

    threads = [threading.Thread(target=run, args=(i,)) for i in range(len(calls))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


def milliseconds(call, times):
    """Sorted durations of `times` calls, one after the other."""
    took = []
    for _ in range(times):
        begin = time.monotonic()
        call()
        took.append(1000 * (time.monotonic() - begin))
    return sorted(took)


def median(values):
    return statistics.median(values)


def check(holds, what):
    print(("held: " if holds else "BROKEN: ") + what, flush=True)
    if not holds:
        check.broken += 1


check.broken = 0


def main(attack):
    """Runs attack(program, long); the process fails when a check did, or when it throws."""
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--long", action="store_true", help="as it was measured, not as the tests run it")
    call = parser.parse_args()
    attack(call.program, call.long)
    sys.exit(1 if check.broken else 0)
