// Figures as the overlay writes them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "app/simulation.hpp"

namespace pf {

// 1,234,567
std::string grouped(std::uint64_t value);
// 1 frame, 1,234 frames. what: a noun whose plural has an s.
std::string counted(std::uint64_t num, const char* what);
// Three digits and k, M, G or T.
std::string short_number(double value);
std::string ms_text(double ms);
std::string time_text(double seconds);
std::string speed_text(double slow_motion);
std::string rounded_text(double value);  // three digits, or whole
std::string rate_text(double frame_ms);  // frames a second; "-" before the first

// The same, whether the budget slows the flight or input waits, and how fast the flight is on a screen whose
// rate is not that of the scene. frames_per_s: of the screen, 0 for a picture or a film.
std::string pace_text(const FrameView& frame, double frames_per_s);

// Simulated time since the start; after the first flight also that of the current one.
std::string clock_text(const FrameView& frame);

// Largest cluster and repetitions of method `exact`.
std::string cluster_text(const StepTotals& totals);

struct NamedText {
  std::string name, text;
};
// The ball's motion, or how the forces on a held one compare with theory.
std::array<NamedText, 3> ball_texts(const FrameView& frame);

// A part of a line. The least important part goes first if there is no room.
struct LinePart {
  std::string text;
  int importance;
};
// The parts with spaces between them, as many as fit. width_of: of a text.
std::string fitting_parts(std::vector<LinePart> parts, float width,
                          const std::function<float(const std::string&)>& width_of);
// The kind of air, with the number of parcels.
std::string air_text(const FrameView& frame);

}  // namespace pf
