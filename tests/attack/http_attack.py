"""What may stand between two requests: bodies that a careless reader takes for the next request, refusals that cost the server more than the
sender, clients that wait for leave, actions as people type them. Short: one of each; --long adds every pair and more bytes."""

import json
import time

import harness
from harness import Server, check


def exchange(server, data, patience=8):
    """Everything that comes back until the server closes; None for the time when it does not."""
    with server.socket(patience) as connection:
        try:
            connection.sendall(data)
        except OSError:
            pass  # it may refuse before it has read everything
        answer = b""
        try:
            while block := connection.recv(65536):
                answer += block
        except TimeoutError:
            return answer, False
        except ConnectionResetError:
            pass
        return answer, True


def smuggling(server, long):
    encodings = ["identity", "gzip", "gzip, chunked", "chunked, chunked", "chunked, gzip", "Chunked", "CHUNKED", "chunked;q=1", "xchunked",
                 "chunked,", ",chunked", '"chunked"', "chunked identity", "\tchunked\x0b", ""]
    lengths = ["+5", "-5", "0x5", "5, 5", "5 5", "5.0", "", "99999999999999999999999"]
    heads = [f"Transfer-Encoding: {value}" for value in encodings] + [f"Content-Length: {value}" for value in lengths]
    heads += ["Content-Length: 5\r\nContent-Length: 5", "Content-Length: 0\r\nTransfer-Encoding: chunked",
              "Transfer-Encoding: chunked\r\nContent-Length: 0", "Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked",
              "Transfer-Encoding : chunked", " Transfer-Encoding: chunked", "X: y\r\n Transfer-Encoding: chunked", "Transfer-Encoding:\r\n chunked",
              "Transfer-Encoding\r\n: chunked", "X: a\r\n\tb"]
    if long:
        heads += [f"Transfer-Encoding: {a}\r\nTransfer-Encoding: {b}" for a in encodings for b in encodings]
        heads += [f"Transfer-Encoding: {a}\r\nContent-Length: {b}" for a in encodings for b in ["0", "5"]]
    secret = f"Authorization: Bearer {server.token}"
    hidden = f"DELETE /api/v1/traces/hidden HTTP/1.1\r\nHost: localhost\r\n{secret}\r\n\r\n"
    wrong = []
    for version in ["HTTP/1.1", "HTTP/1.0"]:
        for head in heads + (["Transfer-Encoding: chunked"] if version == "HTTP/1.0" else []):
            request = f"POST /api/v1/reset {version}\r\nHost: localhost\r\n{secret}\r\nContent-Type: application/json\r\n{head}\r\n\r\n{hidden}"
            answer, closed = exchange(server, request.encode("latin1"))
            if not closed or answer.count(b"HTTP/1.1 ") != 1 or not answer.startswith(b"HTTP/1.1 4"):
                wrong.append((version, head, answer[:60], closed))
    check(not wrong, f"no body is read as the next request, {2 * len(heads) + 1} heads {wrong[:3]}")


def leave(server):
    body = b'{"overlays":true}'
    head = (f"PUT /api/v1/views/main HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {server.token}\r\nContent-Type: application/json\r\n"
            f"Expect: 100-Continue\r\nContent-Length: {len(body)}\r\n\r\n").encode()
    with server.socket() as connection:
        connection.sendall(head)
        check(connection.recv(100).startswith(b"HTTP/1.1 100 "), "a client that waits for leave gets it")
        connection.sendall(body)
        check(b" 200 " in connection.recv(4096)[:20], "and its call is answered")


def quick_refusals(server, long):
    deep_script = {"script": "steps: " + "[" * 100_000}
    many_steps = {"script": "steps:\n" + "  - gripper: open\n" * 12_000}
    flow_steps = {"script": "steps: [" + "gripper: open, " * 16_000 + "]"}
    long_key = {"script": "a" * 200_000 + ": 1"}
    bodies = {
        "100 000 brackets": b"[" * 100_000, "100 000 braces": b'{"a":' * 40_000, "a key of 200 kB": b'{"' + b"k" * 200_000 + b'":1}',
        "a number of 200 kB": b'{"a":' + b"1" * 200_000 + b"}", "a word of 200 kB": b'{"a":' + b"n" * 200_000 + b"}",
        "an open text of 200 kB": b'{"a":"' + b"k" * 200_000, "60 000 values": b"[" + b"0," * 60_000 + b"0]",
        "20 000 keys": b"{" + b",".join(b'"%d":1' % i for i in range(20_000)) + b"}",
        "a script of brackets": json.dumps(deep_script).encode(), "a script of 12 000 steps": json.dumps(many_steps).encode(),
        "a script of 16 000 flow steps": json.dumps(flow_steps).encode(), "a script with a key of 200 kB": json.dumps(long_key).encode(),
        "a script of a quoted text": json.dumps({"script": "task: '" + "x" * 200_000}).encode(),
        "a script of dashes": json.dumps({"script": "- " * 100_000}).encode(),
    }
    harmless = json.dumps({"script": "# " + "x" * 200_000}).encode()
    plain = harness.median(harness.milliseconds(lambda: server.call("POST", "/api/v1/script", harmless), 5))
    for body in bodies.values():  # the first of a kind grows the heap once
        for _ in range(3):
            server.call("POST", "/api/v1/script", body)
            server.call("PUT", "/api/v1/waypoints", body)
    before = server.resident_mb()
    for path in ["/api/v1/script", "/api/v1/waypoints"]:
        method = "PUT" if path.endswith("waypoints") else "POST"
        for name, body in bodies.items():
            statuses = []
            took = harness.milliseconds(lambda: statuses.append(server.call(method, path, body)[0]), 7 if long else 3)
            check(all(400 <= status < 500 for status in statuses) and took[0] < 100 + 5 * plain,
                  f"{method} {path}: {name} is refused quickly ({statuses[0]}, {took[0]:.1f} ms)")
    check(server.resident_mb() - before < 60, f"and the more of them come, nothing grows ({server.resident_mb() - before:.0f} MB)")
    answer, closed = exchange(server, b"POST /api/v1/script HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999\r\n\r\n")
    check(closed and answer.startswith(b"HTTP/1.1 413"), "a body that is too large is refused before it comes")
    chunk = b"2000\r\n" + b" " * 0x2000 + b"\r\n"
    head = f"POST /api/v1/script HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {server.token}\r\nContent-Type: application/json\r\n"
    answer, closed = exchange(server, (head + "Transfer-Encoding: chunked\r\n\r\n").encode() + chunk * 64)
    check(closed and answer.startswith(b"HTTP/1.1 413"), "also one whose size is not told")
    answer, closed = exchange(server, (head + "Transfer-Encoding: chunked\r\n\r\n1;").encode() + b"x" * 300_000)
    check(closed and answer.startswith(b"HTTP/1.1 4"), "a chunk extension without end is cut off")


def places_of_errors(server):
    calls = [("GET", "/api/v1/jobs/j99"), ("DELETE", "/api/v1/jobs/j99"), ("GET", "/api/v1/demos/none"), ("DELETE", "/api/v1/demos/none"),
             ("GET", "/api/v1/traces/none"), ("DELETE", "/api/v1/traces/none"), ("GET", "/api/v1/tasks/none/script"), ("GET", "/api/v1/views/none"),
             ("POST", "/api/v1/teleop/undo"), ("POST", "/api/v1/teleop/save"), ("GET", "/exports/none.png"), ("GET", "/nothing"),
             ("POST", "/api/v1/traces/none/execute"), ("GET", "/api/v1/demos/none/picture"), ("PATCH", "/api/v1/state")]
    missing = [(method, path, answer) for method, path in calls for status, answer in [server.call(method, path, {} if method == "POST" else None)]
               if status < 400 or not (isinstance(answer, dict) and answer["error"].get("where"))]
    check(not missing, f"every refusal names its place {missing[:3]}")
    for path in ["undo", "mark", "gripper", "jog", "save"]:
        status, answer = server.call("POST", "/api/v1/teleop/" + path, b"this is no JSON")
        check(status == 400 and answer["error"].get("where"), f"teleop/{path} refuses what is not JSON ({status})")


def actions(server):
    token = "token=" + server.token
    for query in ["?action=stream?dummy=param.mjpg", "?action=stream&dummy=param.mjpg"]:
        with server.socket() as connection:
            connection.sendall(f"GET /{query}&{token} HTTP/1.0\r\nHost: localhost\r\n\r\n".encode())
            check(b"multipart/x-mixed-replace" in connection.recv(2048), f"/{query} is the stream")
    check(server.call("GET", "/?action=snapshot?dummy=1.jpg")[1][:2] == b"\xff\xd8", "/?action=snapshot?dummy=1.jpg is a picture")
    check(server.call("GET", "/?action=dance")[0] == 400, "an unknown action is refused")


def fragments(server, long):
    """Empty fragments of a message that never ends, as fast as they go."""
    with server.socket(1) as connection:
        connection.sendall((f"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {server.token}\r\nConnection: Upgrade\r\n"
                            "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n").encode())
        check(connection.recv(4096).startswith(b"HTTP/1.1 101"), "a WebSocket opens")
        begin = time.monotonic()
        sent = 0
        connection.settimeout(0.2)
        try:
            connection.sendall(b"\x01\x80\0\0\0\0")
            while time.monotonic() - begin < (60 if long else 20):
                try:
                    sent += connection.send(b"\0\x80\0\0\0\0" * 1000)
                except TimeoutError:
                    pass  # it reads no further
            ended = False
        except OSError:
            ended = True
        check(ended, f"empty fragments end after {sent} bytes and {time.monotonic() - begin:.1f} s")


def attack(program, long):
    with Server(program) as server:
        smuggling(server, long)
        leave(server)
        quick_refusals(server, long)
        places_of_errors(server)
        actions(server)
        fragments(server, long)
        check(server.call("GET", "/api/v1/state")[0] == 200, "the server goes on")


if __name__ == "__main__":
    harness.main(attack)
