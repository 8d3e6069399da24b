#include "process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "core/progress_line.hpp"
#include "view/stage.hpp"

namespace pf {
namespace {

extern "C" void request_stop(int number) {
  stop_requested = true;
  std::signal(number, SIG_DFL);
}

}  // namespace

// Uses fputs because fmt::print throws on a failed write.
void announce(const std::string& line) {
  ProgressLine::clear();
  std::fputs((line + '\n').c_str(), stderr);
}

std::string text_of(const std::system_error& error) {
  const bool of_thread = error.code() == std::errc::resource_unavailable_try_again;
  return fmt::format("a system call failed: {}{}", error.what(), of_thread ? "; give fewer --threads" : "");
}

void reserve_standard_streams() {
  for (int number = 0; number <= 2; ++number) {
    if (::fcntl(number, F_GETFD) == -1 && ::open("/dev/null", O_RDWR) == -1) return;
  }
}

void stop_gracefully() {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  if (std::signal(SIGHUP, request_stop) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

void expect_failing_writes() {
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
}

int after_output(int exit_code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
  announce("pickleflight: standard output cannot be written");
  return exit_code == 0 ? 1 : exit_code;
}

}  // namespace pf
