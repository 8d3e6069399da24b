#include "lab/blast_fit.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace pf {
namespace {

using nlohmann::json;

constexpr double kFirstShare = 0.4;
constexpr std::size_t kTime = 0, kFront = 2;

// Slope of y over x by least squares.
template <class X, class Y>
double slope_of(const json& samples, const X& x_of, const Y& y_of) {
  const double least = kFirstShare * samples.back()[kFront].get<double>();
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (const json& sample : samples) {
    const double radius = sample[kFront].get<double>();
    if (radius < least) continue;
    const double at = x_of(sample[kTime].get<double>()), value = y_of(radius);
    n += 1.0, x += at, y += value, xx += at * at, xy += at * value;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

}  // namespace

double blast_exponent(const json& samples) {
  const auto log = [](double value) { return std::log(value); };
  return slope_of(samples, log, log);
}

double blast_slope(const json& samples) {
  return slope_of(
      samples, [](double time) { return std::sqrt(time); }, [](double radius) { return radius; });
}

}  // namespace pf
