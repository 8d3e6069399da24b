"""Cases of the panel: sliders, menus, switches, typed numbers, scenes, and the cost of the model's terms."""
import json
import math
import os
import subprocess
import time

from bench import NEARLY_STILL, RUN_S, check
from window import wait_for


def values(bench):
    """Sliders by dragging, menus by choosing: the report has each value."""
    with bench.open() as window:
        window.drag_slider("Parcels N", 0.55, 0.5)
        window.drag_slider("Restitution", 0.9, 0.3)
        window.drag_slider("Area fraction", 0.142, 0.25)
        window.choose("Method", "spring")
        window.choose("Neighbours", "all-pairs")
        window.drag_slider("Threads", 0.0, 0.5)
        window.drag_slider("Substeps", 0.0, 0.5)
        time.sleep(0.3)
        report = window.stop()
    # The slider is logarithmic, from 1 to a million: half of it are 1000, a pixel is a sixth.
    check(800 < report["num_parcels"] < 1250, f"N is the slider's: {report['num_parcels']}")
    check(abs(report["restitution"] - 0.3) < 0.02, f"restitution is the slider's: {report['restitution']:.3f}")
    check(abs(report["area_fraction"] - 0.176) < 0.02, f"area fraction is the slider's: {report['area_fraction']:.3f}")
    check(report["method"] == "spring", f"method is that chosen: {report['method']}")
    check(report["neighbors"] == "all-pairs", f"search is that chosen: {report['neighbors']}")
    threads = max((os.cpu_count() + 1) // 2, 1)
    check(report["device"].endswith(f", {threads} thread{'s' if threads > 1 else ''}"),
          f"half of the threads are left: {report['device']}")
    # A frame of 1/600 s of simulated time in 32 steps, or 31 or 33, a pixel being a third of one.
    check(abs(report["dt_s"] * 32 * 600 - 1.0) < 0.05, f"a frame has 32 steps: {report['dt_s'] * 1e6:.1f} us each")


def typed(bench):
    """Numbers typed after control and click: taken, or refused with a line below the control."""
    with bench.open() as window:
        window.type_value("Time step", "0.0002")
        for label, text in (("Restitution", "7"), ("Restitution", "0,5"), ("Time step", "1e9"), ("Parcels N typed", "-5"), ("Ball spin", "1e999")):
            window.type_value(label, text)
            window.wait_for_control(f"{label} refused")
            x0, y0, x1, _ = window.controls()[f"{label} refused"]
            check(y0 >= window.controls()[label][3] and x1 < 318, f"{label} {text} is refused below: {x0}, {y0}")
        window.click("Parcels N typed")
        window.press_key("Escape")
        window.wait_for_control("Ball spin refused", there=False)
        window.type_value("Parcels N typed", "777")
        time.sleep(0.3)
        report = window.stop()
    check(report["dt_s"] == 0.0002, f"the time step is that typed, not that refused: {report['dt_s']} s")
    check(report["restitution"] == 0.9, f"restitution 7 is refused, the scene's stays: {report['restitution']}")
    spin = report["ball"]["spin_radps"]
    check(10.0 < spin < 25.5, f"an infinite spin is refused, the scene's stays: {spin:.1f} rad/s")
    check(report["num_parcels"] == 777, f"N is that typed: {report['num_parcels']}")


def tapped(bench):
    """Return ends a number also where the key is down for a moment only."""
    with bench.open("-p", "20000") as window:
        for label in ("Restitution", "Ball spin", "Friction", "Time scale", "Area fraction"):
            window.type_value(label, "9999999", tap=True)
            window.wait_for_control(f"{label} refused")
        window.stop()
    print("ok: five were ended at once")


def ball_spin(bench):
    """The Magnus term turns the path by k spin / m = 2.7 rad/s; at the scene's 25 rad/s it would be 0.5 rad/s.

    A speed across of v sin(2.7 t) is reached after v t, however slowly this machine lets the time pass.
    """
    with bench.open() as window:
        window.drag_slider("Friction", 0.3, -0.1)
        window.type_value("Ball spin", "140")
        window.click("Reset")
        time.sleep(2 * RUN_S)
        ball = window.stop()["ball"]
    check(abs(ball["spin_radps"] - 140.0) < 1e-9 and ball["hits"] > 0,
          f"spin is that typed, and without friction {ball['hits']} hits leave it alone: {ball['spin_radps']:.9f} rad/s")
    turn_radps = ball["vy_mps"] / ball["distance_m"]
    check(2.0 < turn_radps < 3.0, f"and it bends the flight: {turn_radps:.2f} rad/s, {ball['vy_mps']:.2f} m/s across")


def magnus(bench):
    """The slider of the spin goes from -200 to 200 rad/s."""
    with bench.open() as window:
        window.click("Magnus")
        window.drag_slider("Ball spin", 0.56, 0.85)
        window.press_key("r")
        time.sleep(RUN_S)
        ball = window.stop()["ball"]
    # 0.85 of the slider are 140 rad/s; a pixel is 3 rad/s, and parcels brake the ball by some per cent.
    check(115.0 < ball["spin_radps"] < 145.0, f"spin is the slider's: {ball['spin_radps']:.1f} rad/s")
    check(abs(ball["vy_mps"]) < 1.0, f"without Magnus term it bends nothing: {ball['vy_mps']:.2f} m/s across")


def launch(bench):
    """In a vacuum the ball keeps the speed that it is launched with."""
    with bench.open(*NEARLY_STILL) as window:
        window.choose("Air", "vacuum")
        window.drag_slider("Launch speed", 0.25, 0.5)
        window.drag_slider("Launch angle", 0.5, 0.625)
        window.click("Launch")
        time.sleep(0.3)
        report = window.stop()
    ball = report["ball"]
    check(report["num_parcels"] == 0, "without parcels")
    speed, angle = math.hypot(ball["vx_mps"], ball["vy_mps"]), math.degrees(math.atan2(ball["vy_mps"], ball["vx_mps"]))
    check(abs(speed - 30.0) < 0.5, f"speed is the slider's: {speed:.2f} m/s")  # a pixel is a third of a m/s
    check(abs(angle - 45.0) < 4.0, f"angle is the slider's: {angle:.1f} degrees")  # a pixel is 2 degrees


def terms(bench):
    """Undriven, parcels of the court meet 10^5 times in a second of simulated time, and 400 leave."""
    for wait_s in (1.5, 6.0):  # a busy machine shows few frames
        with bench.open(*NEARLY_STILL) as window:
            window.choose("Boundary", "walls")
            window.click("Contacts")
            window.drag_slider("Parcel speed", 0.1, 0.5)
            window.click("Held")
            window.drag_slider("Time scale", 1 / 3, 1.05)
            time.sleep(wait_s)
            report = window.stop()
        if report["simulated_s"] > 0.2:
            break
    check(report["simulated_s"] > 0.2, f"time runs fast: {report['simulated_s']:.2f} s are simulated")
    check(report["num_retired"] < 10, f"behind walls nothing leaves: {report['num_retired']} did")
    check(report["collisions"]["count"] < 200, f"without contacts, few collisions: {report['collisions']['count']}")
    # N m c^2 = 0.144 J at 1 m/s, 3.6 J at 5 m/s; the ball has 2.9 J and keeps it.
    gained = report["energy"]["final_j"] - report["energy"]["initial_j"]
    check(2.0 < gained < 12.0, f"parcels are as fast as the slider says: {gained:.2f} J more")
    check(report["ball"]["distance_m"] < 0.2, f"the ball is held: {report['ball']['distance_m']:.3f} m flown")


MINI = '[scene]\nname = "{}"\n[world]\nboundary = "walls"\n[air]\nnum_parcels = 321\nrestitution = 0.77\n'


def scene_menu(bench):
    """The menu loads a scene from a file; a scene that cannot be loaded changes nothing."""
    scenes = bench.folder / "scenes"
    scenes.mkdir(exist_ok=True)
    (scenes / "mini.toml").write_text(MINI.format("mini"))
    (scenes / "broken.toml").write_text(MINI.format("broken").replace("restitution", "restituton"))
    with bench.open("--set", "air.restitution=0.2", environment={"PICKLEFLIGHT_ASSETS": str(bench.folder)}) as window:
        window.choose("Scene", "mini")
        window.choose("Scene", "broken")
        time.sleep(RUN_S)
        window.is_running()
        report = window.stop()
    check(report["scene"] == "mini" and report["num_parcels"] == 321, f"it is the chosen scene: {report['scene']}")
    check(report["restitution"] == 0.77, f"the command line's setting is gone: {report['restitution']}")
    check(report["steps"] > 0 and report["num_retired"] == 0, f"and it runs: {report['steps']} steps")
    check(report["ball"]["distance_m"] > 0.2, f"after the broken one, too: {report['ball']['distance_m']:.2f} m")


def save(bench):
    """Saves the panel's settings as a scene and loads it by name."""
    file = bench.folder / "saved.toml"
    file.unlink(missing_ok=True)
    with bench.open("--set", "air.restitution=0.4", "--paused") as window:
        for header in ("Ball", "Air", "Method", "View"):
            window.click(f"{header} header")
        window.click("Presenting header")
        window.wait_for_control("Scene file")
        window.type_text("Scene file", str(file))
        window.click("Save")
        wait_for("saved scene", file.exists, 1.0 if bench.hands_off else 5.0)
        window.stop()
    done = subprocess.run([bench.program, "--headless", "--seconds", "0.02", "--scene", str(file), "--report",
                           str(bench.folder / "saved.json")], stderr=subprocess.DEVNULL)
    report = json.loads((bench.folder / "saved.json").read_text())
    check(done.returncode == 0 and report["scene"] == "saved", f"it loads under its name: {report['scene']}")
    check(report["restitution"] == 0.4 and report["num_parcels"] == 2000, "with the settings of the window")


def unstable(bench):
    """A contact that the step does not resolve is refused while it flies, too, unless it was forced."""
    too_long = ("--dt", "0.002", "--substeps", "1", "--set", "run.spring_contact_s=0.002")
    for words, method in (((), "impulse"), (("--force",), "spring")):
        with bench.open(*too_long, *words) as window:
            window.choose("Method", "spring")
            time.sleep(0.3)
            report = window.stop()
        check(report["method"] == method, f"spring in steps of its contact{' forced' if words else ''}: {report['method']}")


def measured_terms(bench):
    """So many parcels are measured on request only: E, while the run goes on and the full overlay has room for them."""
    csv = bench.folder / "frames.csv"
    with bench.open("-p", "20001", "--time-scale", "0.001", "--overlay-csv", str(csv), "--size", "1280x700") as window:
        window.press_key("o")
        window.press_key("e")
        window.wait_for_control("Notice: Costs of terms are shown above the full overlay; O brings it")
        window.press_key("o")
        window.press_key("o")
        window.resize(800, 700)
        window.press_key("e")
        window.wait_for_control(
            "Notice: Costs of terms are shown above the full overlay: make the window wider, or hide the panel (H)")
        window.resize(1280, 700)
        window.press_key("space")
        window.press_key("e")
        window.wait_for_control("Notice: Costs of terms are measured once the flight goes on (space)")
        window.press_key("space")
        before = csv.read_text().count("\n")
        # Two copies, then four rounds of four terms of 10 pairs, one a frame.
        wait_for("frames", lambda: window.is_running() and csv.read_text().count("\n") > before + 200, 60.0)
        report = window.stop()
    terms = report["terms"]
    check(set(terms) == {"parcels", "contacts", "friction", "Magnus"}, f"every term is there: {set(terms)}")
    known = [name for name, cost in terms.items() if cost is not None]
    check(len(known) == 4, f"E: the cost of each is known: {known}")
