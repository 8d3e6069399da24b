"""The panel's section on accuracy, against the report and --accuracy."""
import json
import math
import subprocess
import time

from bench import check

ELASTIC = ("--scene", "gas", "--set", "run.dt_s=0.1", "--paused")


def open_accuracy(window):
    for header in ("Ball", "Air"):
        window.click(f"{header} header")
    window.click("Accuracy header")
    window.wait_for_control("Work-precision")
    time.sleep(0.3)


def accuracy(bench):
    """The open section shows the figures of the report; its slider does the same as --accuracy."""
    with bench.open(*ELASTIC) as window:
        open_accuracy(window)
        window.press_key("space")
        time.sleep(1.0)
        window.press_key("space")
        time.sleep(0.7)
        report = window.stop()
    shown = report["accuracy"]
    check(shown is not None and shown["simulated_s"] > 1.0, f"it is read out: {shown}")
    drift = report["energy"]["relative_drift"]
    check(abs(drift) > 1e-4 and math.isclose(shown["energy_drift"], drift, rel_tol=1e-6), f"energy drift: {drift:.2e}")
    check(shown["num_collisions"] == report["collisions"]["count"], f"collisions: {shown['num_collisions']}")
    check(shown["max_overlap_diameters"] == report["max_overlap_diameters"], "largest overlap")
    rates = report["collisions"]
    ratio = rates["rate_per_parcel_per_s"] / rates["enskog_rate_per_parcel_per_s"]
    check(math.isclose(shown["rate_over_enskog"], ratio, rel_tol=1e-3), f"rate over Enskog's: {ratio:.3f}")
    for of in (None, "pressure"):
        chosen = chosen_by_flag(bench, "gas", 5, of)
        shown = chosen_in_panel(bench, ELASTIC, 5, of)
        check((shown["method"], shown["dt_s"]) == (chosen["method"], chosen["dt_s"]),
              f"5 % of {of or 'the default of the scene'}: {shown['method']}, {shown['dt_s']:.4f} s, as by --accuracy 5%")
    # An error at which path and drag, the default, ask for different steps, so that the menu tells them apart.
    for percent in (5, 10, 3, 1):
        chosen = {of: chosen_by_flag(bench, "court", percent, of) for of in ("path", "drag")}
        steps = {of: (report["method"], report["dt_s"]) for of, report in chosen.items()}
        if steps["path"] != steps["drag"]:
            break
    check(steps["path"] != steps["drag"], f"path and drag ask for different steps: {steps}")
    shown = chosen_in_panel(bench, ("--scene", "court", "-p", "2000", "--paused"), percent, "path")
    step = (shown["method"], shown["dt_s"])
    check(step == steps["path"], f"{percent} % of path: {step}")


def free_flow(bench):
    """In the tunnel drag and hits of the held ball stand beside theory. In a gas there is nothing to compare."""
    with bench.open("--scene", "tunnel", "-p", "50000", "--paused") as window:
        open_accuracy(window)
        window.press_key("space")
        window.wait_for_control("Drag / theory")
        window.wait_for_control("Hits / theory")
        time.sleep(1.0)
        window.press_key("space")
        time.sleep(0.7)
        shown = window.stop()["accuracy"]
    for of in ("drag", "hits"):
        ratio, error = shown[f"{of}_over_theory"], shown[f"{of}_error"]
        check(0.0 < error < 0.3 and abs(ratio - 1.0) < 4.0 * error, f"{of} over theory: {ratio:.3f} +- {error:.2g}")
    with bench.open(*ELASTIC) as window:
        open_accuracy(window)
        window.press_key("space")
        time.sleep(1.0)
        window.wait_for_control("Drag / theory", there=False)
        shown = window.stop()["accuracy"]
    check(shown["simulated_s"] > 0.0 and shown["drag_over_theory"] is None, "a gas is not compared with it")


def chosen_by_flag(bench, scene, percent, of):
    """The report of a short run with --accuracy."""
    file = bench.folder / "chosen.json"
    subprocess.run([bench.program, "--headless", "--scene", scene, "-p", "2000", "--accuracy", f"{percent}%", "--seconds",
                    "0.02", "--report", str(file), *(("--of", of) if of else ())], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)
    return json.loads(file.read_text())


def chosen_in_panel(bench, words, percent, of):
    """The report of a window in which the accuracy is typed, after the menu named what it is of."""
    with bench.open(*words) as window:
        open_accuracy(window)
        if of:
            window.choose("Error of", of)
        window.type_value("Accuracy", str(percent))
        window.press_key("s")
        time.sleep(0.3)
        return window.stop()
