// The slope of a line through points, by least squares.
#pragma once

namespace pf {

class LineFit {
 public:
  void add(double x, double y) { num_ += 1.0, x_ += x, y_ += y, xx_ += x * x, xy_ += x * y; }
  double num() const { return num_; }
  // At least two points of different x.
  double slope() const { return (num_ * xy_ - x_ * y_) / (num_ * xx_ - x_ * x_); }

 private:
  double num_ = 0.0, x_ = 0.0, y_ = 0.0, xx_ = 0.0, xy_ = 0.0;  // sums over the points
};

}  // namespace pf
