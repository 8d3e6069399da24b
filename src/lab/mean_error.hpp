// Mean of equally weighted samples and its standard error from their scatter.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

namespace pf {

// For samples that come one by one (Welford 1962).
class Mean {
 public:
  void add(double x) {
    const double off = x - mean_;
    mean_ += off / ++num_;
    squares_ += off * (x - mean_);
  }
  // Not a number without samples.
  double value() const { return num_ > 0 ? mean_ : std::numeric_limits<double>::quiet_NaN(); }
  // 0 for one sample.
  double error() const { return num_ > 1 ? std::sqrt(squares_ / (1.0 * num_ * (num_ - 1))) : 0.0; }

 private:
  double mean_ = 0.0, squares_ = 0.0;  // sum of squared distances from the mean
  int num_ = 0;
};

struct MeanError {
  double mean, sigma;
};

// Of get(row) over the rows.
template <class Rows, class Get>
MeanError mean_of_each(const Rows& rows, const Get& get) {
  Mean mean;
  for (const auto& row : rows) mean.add(get(row));
  return {mean.value(), mean.error()};
}

inline MeanError mean_and_error(const std::vector<double>& values) {
  return mean_of_each(values, [](double value) { return value; });
}

}  // namespace pf
