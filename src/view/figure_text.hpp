// Figures of flights as short texts.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace pf {

constexpr int kFramesPerText = 6;  // a text stays, so that it can be read

// Three digits; never an exponent for large numbers.
inline std::string digits(double value) {
  if (std::fabs(value) < 999.5) return fmt::format("{:.3g}", value);
  const double unit = std::pow(10.0, std::floor(std::log10(std::fabs(value))) - 2.0);
  return fmt::format("{:.0f}", unit * std::round(value / unit));
}

inline std::string length_text(double m) {
  if (m < 1e-12) return "0 m";  // a rounding
  if (m >= 1.0) return digits(m) + " m";
  return m >= 1e-4 ? digits(1e3 * m) + " mm" : digits(1e6 * m) + " \xC2\xB5m";
}

inline std::string duration_text(double ms) {
  return ms < 999.5 ? digits(ms) + " ms" : digits(1e-3 * ms) + " s";
}

// A relative change in per cent, with its sign.
inline std::string drift_text(double drift) {
  return fmt::format("{}{} %", drift > 0.0 ? "+" : "", digits(100.0 * drift));
}

}  // namespace pf
