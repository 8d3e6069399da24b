#include "core/progress_line.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdio>

namespace pf {
namespace {

constexpr double kBetweenLines_s = 10.0;
// Width of the terminal less one column, so that the line does not wrap.
std::size_t max_length() {
  winsize size{};
  const bool is_known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 20;
  return is_known ? size.ws_col - 1U : 110U;
}

std::atomic<bool> is_shown = false;  // on the terminal

}  // namespace

ProgressLine::ProgressLine(double quiet_s, double min_interval_s)
    : is_terminal_(::isatty(STDERR_FILENO) == 1),
      next_s_(is_terminal_ || quiet_s == 0.0 ? quiet_s : kBetweenLines_s),
      between_s_(is_terminal_ ? min_interval_s : kBetweenLines_s) {}

bool ProgressLine::is_due() const { return spent_s() >= next_s_; }

void ProgressLine::show(const std::string& line) {
  next_s_ = spent_s() + between_s_;
  clear();
  std::fputs((line.substr(0, max_length()) + (is_terminal_ ? "" : "\n")).c_str(), stderr);
  std::fflush(stderr);
  is_shown = is_terminal_;
}

void ProgressLine::clear() {
  if (is_shown.exchange(false)) std::fputs("\r\033[K", stderr);
}

std::string time_left_text(double done, double spent_s) {
  if (done <= 0.0) return "";
  return "; about " + std::to_string(std::llround(spent_s * (1.0 - done) / done)) + " s left";
}

}  // namespace pf
