"""What the limits of serve do, and what it says aloud: too few descriptors, streams and connections, names, tokens."""

import re
import resource
import subprocess
import tempfile

import harness
from harness import Server, check


def refusal(program, *options, descriptors=None):
    """(exit code, stderr) of a serve that must not start."""
    def limit():
        if descriptors:
            resource.setrlimit(resource.RLIMIT_NOFILE, (descriptors, descriptors))

    with tempfile.TemporaryDirectory(prefix="flowscope-attack-") as data:
        ended = subprocess.run([program, "serve", "--port", "0", "--data", data, *options], capture_output=True, text=True, timeout=120,
                               preexec_fn=limit, stdin=subprocess.DEVNULL)
    return ended.returncode, ended.stderr


def descriptors(program):
    for count in [16, 24, 30]:
        code, said = refusal(program, descriptors=count)
        check(code == 1 and "descriptors" in said and "EGL" not in said, f"with {count} descriptors it says so ({code}: {said.strip()[-100:]})")
    for count in [40, 200]:
        with Server(program, preexec=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (count, count))) as server:
            check("too few file descriptors" in server.messages(), f"with {count} it serves fewer connections, and says so")
            held = [server.socket() for _ in range(300)]
            check(server.call("GET", "/snapshot")[1][:2] == b"\xff\xd8", "and a crowd does not use them up: there are pictures")
            for connection in held:
                connection.close()


def wrong_options(program):
    for options, word in [(["--max-connections", "100000"], "--max-connections"), (["--max-descriptors", "9999999"], "--max-descriptors"),
                          (["--max-connections", "20", "--max-streams", "30"], "--max-streams"), (["--max-streams", "0"], "--max-streams"),
                          (["--allow-host", "http://robot"], "--allow-host"), (["--allow-host", "*"], "--allow-host"),
                          (["--base-path", "/a b"], "--base-path"), (["--token", "two words here and more"], "--token")]:
        code, said = refusal(program, *options)
        check(code == 2 and word in said, f"{' '.join(options)} is refused with its name ({code})")


def few_streams(program):
    with Server(program, "--max-streams", "2", "--max-connections", "16") as server:
        held = []
        for _ in range(2):
            viewer = server.socket()
            viewer.sendall(f"GET /stream?token={server.token} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            check(b" 200 " in viewer.recv(1024)[:20], "a stream opens")
            held.append(viewer)
        status, answer = server.call("GET", "/stream")
        check(status == 503 and "--max-streams" in answer["error"]["message"], "one too many is told why")
        for viewer in held:
            viewer.close()


def warnings(program):
    for options, words in [(["--no-token"], ["no token"]), (["--host", "0.0.0.0"], ["0.0.0.0", "token"]), (["--token", "short"], ["16"]),
                           (["--host", "0.0.0.0", "--no-token"], ["0.0.0.0", "without a token"]), ([], [])]:
        with Server(program, *options) as server:
            said = [line for line in server.messages().splitlines() if "WARNING" in line]
            check(len(said) == (1 if words else 0) and all(word in said[0] for word in words), f"{options}: {said}")
    with Server(program, "--allow-host", "robot.example.com", "--allow-host", "hub.example.com", "--base-path", "/proxy/1/") as server:
        for host, wanted in [("robot.example.com", 200), ("hub.example.com:443", 200), ("localhost", 200), ("evil.example.com", 403)]:
            status, answer = server.call("GET", "/proxy/1/api/v1/state", headers={"Host": host})
            check(status == wanted, f"asked as {host}: {status}")
        check("--allow-host evil.example.com" in answer["error"]["message"], "the refusal names the option")
        check(re.search(r"/proxy/1/\?token=", server.line), "the printed address holds the path")


def attack(program, long):
    descriptors(program)
    wrong_options(program)
    few_streams(program)
    warnings(program)


if __name__ == "__main__":
    harness.main(attack)
