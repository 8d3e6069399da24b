#include "lab/blast_fit.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "lab/line_fit.hpp"

namespace pf {
namespace {

using nlohmann::json;

constexpr double kFirstShare = 0.4;
constexpr std::size_t kTime = 0, kFront = 1;

// Slope of y over x.
template <class X, class Y>
double slope_of(const json& samples, const X& x_of, const Y& y_of) {
  const double min_radius = kFirstShare * samples.back()[kFront].get<double>();
  LineFit fit;
  for (const json& sample : samples) {
    const double radius = sample[kFront].get<double>();
    if (radius >= min_radius) fit.add(x_of(sample[kTime].get<double>()), y_of(radius));
  }
  return fit.slope();
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
