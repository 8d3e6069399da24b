#!/usr/bin/python3
"""The window as a person uses it: sliders, menus, keys, and the report of the run.

test_window.py PROGRAM CASE...   exit 0: as it should be, 1: not, 77: no Xvfb or no xdotool
test_window.py PROGRAM --hands-off   all cases, but no key or button is pressed: exit 0 if each of them fails

Each case works several controls of one window. Undriven, a window shows the court: 2000 parcels, restitution 0.9,
area fraction 0.1, method impulse, search grid, ball 15 m/s and 25 rad/s, all threads.
"""
import sys
import tempfile

from accuracy_cases import accuracy, free_flow
from bench import Bench
from camera_cases import follow_key, follow_option, large_text, magnifier_alone, magnifier_key
from key_cases import (answers, back_key, buttons, escape, keys, launch_key, leave, method_key, other_keyboards, ring,
                       slingshot, slingshot_paused, stays, time_keys)
from panel_cases import (ball_spin, launch, magnus, measured_terms, save, scene_menu, tapped, terms, typed, unstable,
                         values)
from row_cases import chart, knobs, labels, tooltips
from split_cases import split_key, split_panel
from view_cases import compared, dense_screen, key_card, looks, narrow, scene_words, view_keys, vsync_key
from window import Screen, skip_if_missing

CASES = {case.__name__: case for case in (values, typed, tapped, ball_spin, magnus, launch, terms, scene_menu, scene_words, keys,
                                          launch_key, other_keyboards, buttons, view_keys, slingshot, slingshot_paused, ring, method_key,
                                          back_key, compared, time_keys, save, looks, vsync_key, accuracy, free_flow,
                                          unstable, measured_terms, dense_screen, narrow, key_card, knobs, tooltips, labels, chart, answers,
                                          stays, escape, leave, follow_key, follow_option, magnifier_alone, magnifier_key,
                                          large_text, split_key, split_panel)}


def fails(case, bench):
    try:
        case(bench)
    except AssertionError as error:
        print(f"{case.__name__} failed, as it should: {error}")
        return True
    print(f"{case.__name__} PASSED WITHOUT HANDS")
    return False


def main():
    program, words = sys.argv[1], sys.argv[2:]
    skip_if_missing()
    hands_off = words == ["--hands-off"]
    names = list(CASES) if hands_off else words
    with Screen() as screen, tempfile.TemporaryDirectory() as folder:
        bench = Bench(program, screen, folder, hands_off)
        if hands_off:
            blind = [name for name in names if not fails(CASES[name], bench)]
            sys.exit(f"FAILED: blind: {', '.join(blind)}" if blind else 0)
        for name in names:
            CASES[name](bench)


if __name__ == "__main__":
    main()
