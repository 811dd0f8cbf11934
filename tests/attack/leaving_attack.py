"""SIGTERM while everything is under way: gone within five seconds, what was in flight is told so, nothing is lost."""

import os
import threading
import time

from harness import Server, check, main


def attack(program, long):
    for round in range(5 if long else 1):
        with Server(program) as server:
            record = server.job(server.call("POST", "/api/v1/script", {"record": True})[1]["job"])
            server.call("POST", "/api/v1/train", {"action": "start", "preset": "nano", "steps": 20})
            server.wait_for(lambda: not server.call("GET", "/api/v1/train")[1]["running"], 120, "20 steps are trained")
            server.call("POST", "/api/v1/train", {"action": "start", "preset": "desk", "resume": False})
            server.wait_for(lambda: server.call("GET", "/api/v1/train")[1]["step"] >= 1, 120, "training goes on")
            for kind in ("png", "mp4", "cloud"):
                for _ in range(5):
                    server.call("POST", "/api/v1/export", {"kind": kind, "width": 3840, "height": 2160,
                                                           **({"demo": record["result"]["demo"]} if kind == "mp4" else {})})
            server.call("POST", "/api/v1/script", {"record": True})
            answers = []

            def ask(body):
                try:
                    answers.append(server.call("POST", "/api/v1/predict", body)[0])
                except OSError as error:
                    answers.append(error)

            calls = [threading.Thread(target=ask, args=({"flow_steps": 1000, "samples": 4},)) for _ in range(2)]
            for call in calls:
                call.start()
            time.sleep(0.5 + round)
            code, seconds = server.terminate()
            for call in calls:
                call.join()
            check(code == 0 and seconds < 5, f"exit {code} after {seconds:.1f} s")
            check(answers == [503, 503], f"the predictions in flight got {answers}")
            check("ending" in server.messages() and "terminate" not in server.messages(), "it ends as it should")
            left = [name for folder in ("exports", "demos", "policies", "traces")
                    for name in os.listdir(os.path.join(server.data, folder)) if ".part" in name or "tmp" in name]
            check(left == [], f"no part of a file is left: {left}")
            check(os.path.exists(os.path.join(server.data, "policies", "live.flow")), "what was trained is kept")


main(attack)
