// A slider whose number does not stand on its knob.
#pragma once

#include <array>
#include <cstdint>

namespace pf {

// The knob's place on a slider, from 0 to 1. Low ends of 0 on logarithmic sliders count as a ten thousandth
// of the high end.
double knob_share(double value, double low, double high, bool logarithmic);

// As ImGui::SliderScalar. The number stands in the half without the knob; while it is typed, where it is
// typed.
template <class Number>  // double or std::int64_t
bool slide(const char* id, Number& value, const std::array<Number, 2>& ends, const char* format,
           int flags = 0);

}  // namespace pf
