// Keys and gestures of the window in words. The card over the picture and --help show this table, and a test
// compares the one in docs/using.md.
#pragma once

#include <string>

namespace pf {

struct KeyRow {
  const char* keys;
  const char* does;
};

inline constexpr KeyRow kMouseRows[] = {
    {"drag the ball, or its start (a ring shows it)", "pull back and let fly; speed in m/s and mph"},
    {"the same with Shift", "up and down: spin in rad/s and rpm"},
    {"drag elsewhere, right drag", "pan"},
    {"wheel / double click", "zoom at the pointer or in the magnifier / fit the view"},
    {"drag on the bar below the scene", "back and forth through this flight"},
    {"drop a scene or cue list", "load it"}};

inline constexpr KeyRow kKeyRows[] = {
    {"space / S", "pause, go on / one frame, while paused"},
    {"[ ] (or , .)", "half, double the pace, down to 1/1000"},
    {"B", "back by a second of film, and says to what time; again: further"},
    {"R / L", "back to the start / launch again, the air as it is"},
    {"M", "the same launch with the next method; both stay"},
    {"Shift+M", "the same launch with half the time step; again: with the scene's"},
    {"X", "two methods at once: in two halves, in one picture, off"},
    {"T / G", "path of the ball / ghost paths"},
    {"H / O", "hide panel / overlay: full, one line, off"},
    {"F / F11 / V", "fit the view / full screen / vertical sync"},
    {"Z / N", "camera that follows the ball / magnifier on the ball"},
    {"D / C", "light, dark theme / colours of the parcels"},
    {"+ -", "larger, smaller text and overlay"},
    {"F9 / F12", "begin, end a film / picture"},
    {"1-9", "go to that cue of the list (--cues)"},
    {"PgDn / PgUp", "next / previous cue"},
    {"Ctrl+Z", "undo the last change of a setting, step by step"},
    {"Ctrl+Y or Ctrl+Shift+Z", "redo it"},
    {"F10", "the last seconds as an animated GIF or WebP"},
    {"Shift+F12", "court, paths and ball as SVG"},
    {"E", "measure what each term of the model costs"},
    {"F1 or ?", "all keys on a card; again or Esc: closes it"},
    {"Esc", "close a menu; stop aiming; leave full screen; twice: quit"}};

// The table for --help, a line per row.
std::string key_help();

}  // namespace pf
