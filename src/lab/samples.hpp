// Random numbers and means for validation.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>

namespace pf {

// Mean of equally weighted samples and its standard error from their scatter.
class Mean {
 public:
  void add(double x) {
    sum_ += x;
    sum2_ += x * x;
    ++num_;
  }
  double value() const { return sum_ / num_; }
  double error() const {
    const double variance = sum2_ / num_ - value() * value();
    return num_ > 1 ? std::sqrt(std::max(0.0, variance) / (num_ - 1)) : 0.0;
  }

 private:
  double sum_ = 0.0, sum2_ = 0.0;
  int num_ = 0;
};

// Uniform in [0, 1).
inline double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

}  // namespace pf
