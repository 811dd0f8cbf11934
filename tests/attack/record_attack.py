"""Scripts that are recorded, run, cancelled and reset at the same moment: what the program calls saved is there and good."""

import json
import random
import subprocess
import time

import harness
from harness import check


def requests_of(kind, server, seed):
    """The calls of one round, to be made at one moment or within a second."""

    def post(path, body):
        return lambda: server.call("POST", "/api/v1/" + path, body)

    def reset(task):
        return post("reset", {"task": task, "variation": 0, "seed": seed})

    def cancel():
        for job in server.call("GET", "/api/v1/jobs")[1]["jobs"]:
            if job["state"] == "running":
                server.call("DELETE", "/api/v1/jobs/" + job["id"])

    record, run = post("script", {"record": True}), post("script", {"record": False})
    jog = post("teleop/jog", {"linear": [0, 0, 0.1]})
    save = post("teleop/save", {"unfinished": True})
    return {
        "three recordings and a run": [record, record, run, record],
        "a run before a recording": [run, record],
        "a reset between": [record, reset("push_buttons"), record],
        "another task between": [record, reset("open_drawer"), record, reset("push_buttons")],
        "cancelled": [record, cancel, record],
        "moved by hand between": [jog, record, save, jog, run, record],
    }[kind]


KINDS = ("three recordings and a run", "a run before a recording", "a reset between", "another task between", "cancelled",
         "moved by hand between")


def round_of(server, kind, seed, at_once, rng):
    """The demonstrations that this round's answers called saved."""
    server.call("POST", "/api/v1/reset", {"task": "push_buttons", "variation": 0, "seed": seed})
    calls = requests_of(kind, server, seed)
    if at_once:
        answers = harness.side_by_side(calls)
    else:
        answers = []
        for call in calls:
            answers.append(call())
            time.sleep(rng.uniform(0, 0.3))
    saved = []
    for answer in answers:
        if not isinstance(answer, tuple) or answer[0] >= 300 or not isinstance(answer[1], dict):
            continue
        if "job" in answer[1]:
            job = server.job(answer[1]["job"])
            demo = job.get("result", {}).get("demo")
            if demo or job["message"].startswith("saved"):
                saved.append(demo)
        elif answer[1].get("demo"):
            saved.append(answer[1]["demo"])
    return saved


def attack(program, long):
    rng = random.Random(13)
    rounds = 18 if long else 1
    with harness.Server(program) as server:
        said = []
        seed = 100
        for _ in range(rounds):
            for kind in KINDS:
                for at_once in (True, False):
                    seed += 1
                    said += round_of(server, kind, seed, at_once, rng)
        listed = {demo["id"] for demo in server.call("GET", "/api/v1/demos")[1]["demos"]}
        check(all(said), "every job that said saved names its demonstration")
        check(set(said) <= listed, f"each of the {len(said)} that were called saved is there")
        check(len(set(said)) == len(said), "no two jobs name the same")
        check(len(said) >= 3 * rounds, f"enough was recorded for this to tell: {len(said)}")
        found = subprocess.run([program, "demos", "check", "--data", server.data, "--json"], capture_output=True, text=True)
        report = json.loads(found.stdout)
        check(report["checked"] == len(listed), "no file that the list does not show")
        check(report["bad"] == [], f"all {report['checked']} pass the store's own check: {report['bad']}")
        check(server.call("GET", "/health")[0] == 200, "the server still answers")


if __name__ == "__main__":
    harness.main(attack)
