// A slider whose number does not stand on its knob.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace pf {

// The knob's place on a slider, from 0 to 1. nearly_zero: what a low end of 0 counts as on a logarithmic one.
double knob_share(double value, double low, double high, bool logarithmic, double nearly_zero = 1e-5);
// Unit of the last decimal of an ImGui format, as 0.001 for "%.3f s".
double last_decimal(const char* format);

// The value by a printf format; with three significant digits where the format would round it by more than
// 0.5 %.
std::string number_text(const char* format, double value);

// The room beside a knob, from x0 to x1: of the two sides the larger. low, high: edges of the slider.
struct BesideKnob {
  float x0 = 0.0F;
  float x1 = 0.0F;
};
BesideKnob beside_knob(float low, float high, float knob_px, double share, float padding_px);

// A number that is too long for its room without its unit: "0.00100 free times" becomes "0.00100".
std::string without_unit(const std::string& text);

// As ImGui::SliderScalar. Writes the number beside the knob, on the wider side; a typed number stays in its
// field.
template <class Number>  // double or std::int64_t
bool slide(const char* id, Number& value, const std::array<Number, 2>& ends, const char* format,
           int flags = 0);

}  // namespace pf
