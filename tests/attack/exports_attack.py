"""Many large exports at once: few run, some wait, the rest is told so; what is cancelled ends and leaves no file."""

import os
import time

from harness import Server, check, main, median, milliseconds, side_by_side


def over(status):
    return status["state"] in ("done", "failed", "cancelled")


def cancel_latency(server, body, settle):
    """Milliseconds from DELETE to `cancelled`, for a job that has run for `settle` seconds."""
    job = server.call("POST", "/api/v1/export", body)[1]["job"]
    server.wait_for(lambda: server.call("GET", "/api/v1/jobs/" + job)[1]["state"] == "running", 60, "it runs")
    time.sleep(settle)
    begin = time.monotonic()
    server.call("DELETE", "/api/v1/jobs/" + job)
    last = server.job(job)
    return last["state"], 1000 * (time.monotonic() - begin)


def attack(program, long):
    large = {"kind": "png", "width": 3840, "height": 2160}
    with Server(program) as server:
        demo = server.job(server.call("POST", "/api/v1/script", {"record": True})[1]["job"])["result"]["demo"]
        exports = os.path.join(server.data, "exports")
        before_mb, before_threads = server.resident_mb(), server.threads()

        answers = side_by_side([lambda: server.call("POST", "/api/v1/export", large)] * 24)
        jobs = [body["job"] for code, body in answers if code == 202]
        refused = [body for code, body in answers if code == 429]
        check(len(jobs) + len(refused) == 24 and len(jobs) <= 20, f"of 24 at once {len(jobs)} are taken, {len(refused)} get 429")
        check(all("try again" in body["error"]["message"] for body in refused), "the refusal says what to do")
        check(server.threads() - before_threads <= 30, "no thread for each of them")
        states = [job["state"] for job in server.call("GET", "/api/v1/jobs")[1]["jobs"] if job["id"] in jobs]
        check(states.count("running") <= 2 and states.count("queued") >= len(jobs) - 6, "two run, the others are queued")

        script = server.call("POST", "/api/v1/script", {})[1]["job"]
        server.wait_for(lambda: server.call("GET", "/api/v1/jobs/" + script)[1]["state"] != "queued", 10,
                        "a script waits for no export")
        quick = milliseconds(lambda: server.call("GET", "/api/v1/state"), 20)
        check(median(quick) < 200, f"/state takes {median(quick):.0f} ms beside them")
        server.job(script)

        begin = time.monotonic()
        for job in reversed(jobs):
            server.call("DELETE", "/api/v1/jobs/" + job)
        ends = [server.job(job)["state"] for job in jobs]
        took = time.monotonic() - begin
        check(all(state in ("cancelled", "done") for state in ends) and took < 5, f"all are over {took:.1f} s after DELETE")
        peak = server.resident_mb()
        check(peak - before_mb < 600, f"{before_mb:.0f} MB before, {peak:.0f} MB after them")
        done = [server.call("GET", "/api/v1/jobs/" + job)[1] for job in jobs]
        wanted = {os.path.basename(job["result"]["url"]) for job in done if job["state"] == "done"}
        check(set(os.listdir(exports)) == wanted, "a cancelled export leaves no file, nor a part of one")

        kinds = {"png": large, "png of a demo": {**large, "demo": demo}, "cloud": {"kind": "cloud"},
                 "film of a demo": {"kind": "mp4", "demo": demo, "width": 3840, "height": 2160}}
        rounds = 10 if long else 2
        for name, body in kinds.items():
            took = [cancel_latency(server, body, 0.15 * i) for i in range(rounds)]
            late = max(ms for state, ms in took if state == "cancelled") if any(s == "cancelled" for s, _ in took) else 0
            # The aim is 100 ms; a busy machine has other things to do.
            check(late < 1000, f"{name}: cancelled after at most {late:.0f} ms")

        for _ in range(40 if long else 6):
            server.job(server.call("POST", "/api/v1/export", {"kind": "cloud"})[1]["job"])
        check(len(server.call("GET", "/api/v1/jobs")[1]["jobs"]) <= 125, "old jobs are forgotten")


main(attack)
