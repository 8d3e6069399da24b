// A line for the person that goes by itself.
#pragma once

#include <string>
#include <utility>

#include "core/timing.hpp"

namespace pf {

constexpr double kNotice_s = 2.0;

class PassingNotice {
 public:
  void show(std::string text, Clock::time_point now, double shown_s = kNotice_s) {
    text_ = std::move(text);
    began_ = now;
    shown_s_ = shown_s;
  }
  // Empty after its time.
  std::string text(Clock::time_point now) const {
    return std::chrono::duration<double>(now - began_).count() < shown_s_ ? text_ : std::string();
  }

 private:
  std::string text_;
  Clock::time_point began_;
  double shown_s_ = kNotice_s;
};

}  // namespace pf
