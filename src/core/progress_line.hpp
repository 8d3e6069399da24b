// A line of progress on standard error: rewritten on a terminal, otherwise a new one every ten seconds.
#pragma once

#include <string>

#include "core/timing.hpp"

namespace pf {

class ProgressLine {
 public:
  // Nothing is due before quiet_s, nor on a terminal before min_interval_s after the line before.
  ProgressLine(double quiet_s, double min_interval_s);
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool is_due() const;
  void show(const std::string& line);  // cut to the width of the terminal
  double spent_s() const { return 1e-3 * milliseconds_since(start_); }

  // Clears the line from the terminal. Call it before anything else is written there.
  static void clear();

 private:
  bool is_terminal_;
  double next_s_;  // after the start
  double between_s_;
  Clock::time_point start_ = Clock::now();
};

// "; about 12 s left"; empty where nothing is done yet. done: share of the work that took spent_s.
std::string time_left_text(double done, double spent_s);

}  // namespace pf
