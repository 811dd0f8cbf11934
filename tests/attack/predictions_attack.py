"""Long predictions: bounded, and nobody waits for them: not short ones, nor a reset, a picture, the end of training."""

import threading
import time

from harness import Server, check, main, side_by_side


def attack(program, long):
    with Server(program) as server:
        server.job(server.call("POST", "/api/v1/script", {"record": True})[1]["job"])
        server.call("POST", "/api/v1/train", {"action": "start", "preset": "nano", "steps": 20})
        server.wait_for(lambda: not server.call("GET", "/api/v1/train")[1]["running"], 120, "20 steps are trained")

        code, body = server.call("POST", "/api/v1/predict", {"flow_steps": 1000, "samples": 64})
        check(code == 400 and body["error"]["where"] in ("samples", "flow_steps"), f"1000 steps x 64 samples: {code}")
        code, body = server.call("POST", "/api/v1/predict", {"flow_steps": 1000, "samples": 2, "integrator": "rk4"})
        check(code == 400, "stages count, too")

        answers = {}

        def ask(name):
            answers[name] = server.call("POST", "/api/v1/predict", {"flow_steps": 1000, "samples": 4}, timeout=300)

        threads = [threading.Thread(target=ask, args=(i,)) for i in range(2)]
        for thread in threads:
            thread.start()
        time.sleep(0.3)
        code, _ = server.call("POST", "/api/v1/predict", {"flow_steps": 1000, "samples": 4})
        check(code == 429, f"a third long one is refused: {code}")

        for name, call in {
            "a short prediction": lambda: server.call("POST", "/api/v1/predict", {}),
            "a reset": lambda: server.call("POST", "/api/v1/reset", {"task": "push_buttons", "seed": 1}),
            "a picture": lambda: server.call("GET", "/snapshot"),
            "the end of training": lambda: server.call("POST", "/api/v1/train", {"action": "stop"}),
        }.items():
            begin = time.monotonic()
            code, _ = call()
            took = time.monotonic() - begin
            passed = code == 200 and any(thread.is_alive() for thread in threads)
            check(passed and took < 5, f"{name} passes them: {code} after {took:.2f} s")
        if long:
            for thread in threads:
                thread.join()
            check(all(code == 200 for code, _ in answers.values()), "the long ones end as they should")
        shorts = side_by_side([lambda: server.call("POST", "/api/v1/predict", {})[0]] * 8)
        check(set(shorts) <= {200, 429, 503}, f"eight short ones at once: {shorts}")
        code, seconds = server.terminate()
        for thread in threads:
            thread.join()
        check(code == 0 and seconds < 5, f"SIGTERM: exit {code} after {seconds:.1f} s")
        told = [code for code, _ in answers.values()]
        check(all(code in (200, 503) for code in told) and len(told) == 2, f"the calls in flight got {told}")


main(attack)
