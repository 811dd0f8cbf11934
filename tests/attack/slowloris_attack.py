"""Hundreds of connections that say nothing, or a little now and then: the others must not notice. Short: 500 sockets for six seconds; --long: 2000
sockets, a minute."""

import multiprocessing
import os
import time

import harness
from harness import Server, check

pieces = [b"", b"GET /api/v1/state HTTP/1.1\r\n", b"GET /api/v1/state HTTP/1.1\r\nHost: localhost\r\nX: ", b"\r",
          b"POST /api/v1/reset HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\n{", b"G", b"GET /health HTTP/1.1\r\nHost: localhost\r\n\r\n"]


class Siege:
    """Keeps `count` connections half open: who is closed comes again, and each says one letter a second."""

    def __init__(self, server, count):
        self.server, self.count, self.over, self.arrivals = server, count, multiprocessing.Event(), multiprocessing.Value("i", 0)
        # A process: a thread of this one would slow down the clock, not the server.
        self.process = multiprocessing.Process(target=self.run)

    @property
    def came(self):
        return self.arrivals.value

    def __enter__(self):
        self.process.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.process.join()

    def run(self):
        held = []
        while not self.over.is_set():
            for _ in range(min(50, self.count - len(held))):
                try:
                    connection = self.server.socket(2)
                    connection.setblocking(False)
                    connection.send(pieces[self.came % len(pieces)] or b"")
                    held.append(connection)
                    self.arrivals.value += 1
                except OSError:
                    break
            alive = []
            for connection in held:
                try:
                    if connection.recv(4096) == b"":
                        raise OSError
                    alive.append(connection)
                except BlockingIOError:
                    alive.append(connection)
                except OSError:
                    connection.close()
            if self.came % 5 == 0:
                for connection in alive[::7]:
                    try:
                        connection.send(b"x")
                    except OSError:
                        pass
            held = alive
            time.sleep(0.02)
        for connection in held:
            connection.close()


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def attack(program, long):
    with Server(program) as server:
        kept = harness.http.client.HTTPConnection(server.host, server.port, timeout=30)

        def ask_kept():
            kept.request("GET", "/api/v1/state", headers={"Authorization": "Bearer " + server.token})
            answer = kept.getresponse()
            answer.read()
            return answer.status

        check(ask_kept() == 200, "a client that shows the token is answered")
        idle = harness.milliseconds(lambda: server.call("GET", "/api/v1/state"), 200)
        with Siege(server, 2000 if long else 500) as siege:
            server.wait_for(lambda: siege.came >= siege.count, 60, "the siege stands")
            took, refused, kept_calls = [], [], 0
            end = time.monotonic() + (60 if long else 6)
            while time.monotonic() < end:
                begin = time.monotonic()
                try:
                    status = server.call("GET", "/api/v1/state", timeout=10)[0]
                except Exception as error:
                    status = repr(error)
                took.append(1000 * (time.monotonic() - begin))
                if status != 200:
                    refused.append(status)
                if len(took) % 200 == 0:  # a minute without a call would end it by its own deadline
                    kept_calls += ask_kept() == 200
                time.sleep(0.01)
            check(ask_kept() == 200, f"who showed the token kept the connection, for {kept_calls + 1} calls")
        late = percentile(took, 0.99)
        check(not refused, f"none of {len(took)} calls is refused {refused[:3]}")
        usual = percentile(idle, 0.99)
        said = f"(without the siege {usual:.1f} ms; {siege.came} sockets came)"
        load = os.getloadavg()[0] / os.cpu_count()
        if long or load < 2:
            check(late < 100, f"the 99th percentile of others' calls is {late:.1f} ms {said}")
        else:  # every process waits for its turn: the slowest of a few calls says nothing about the server
            check(harness.median(took) < 100 * load, f"the median of others' calls is {harness.median(took):.1f} ms on a busy machine {said}")
        check(server.call("GET", "/health")[0] == 200, "the server goes on")
    kept.close()


if __name__ == "__main__":
    harness.main(attack)
