#include "app/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/error.hpp"
#include "core/text.hpp"

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX leaves it to the program

namespace pf {
namespace {

[[noreturn]] void fail(const std::string& call, int error) {
  throw DeviceError(fmt::format("{} failed: {}", call, std::strerror(error)));
}

pid_t spawn(std::vector<std::string> arguments, int input, int errors) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  if (input >= 0)
    posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  else
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, errors, STDERR_FILENO);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  pid_t pid = -1;
  const int error = posix_spawnp(&pid, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) fail("starting " + arguments[0], error);
  return pid;
}

}  // namespace

ChildProcess::ChildProcess(std::vector<std::string> arguments, int input)
    : errors_(::memfd_create("errors-of-child", MFD_CLOEXEC)) {
  if (errors_.get() < 0) fail("memfd_create", errno);
  pid_ = spawn(std::move(arguments), input, errors_.get());
}

ChildProcess::~ChildProcess() {
  if (!running()) return;
  signal(SIGKILL);
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) continue;
}

std::optional<ChildExit> ChildProcess::collect(int flags) {
  int status = 0;
  rusage usage{};
  pid_t ended = -1;
  while ((ended = ::wait4(pid_, &status, flags, &usage)) < 0) {
    if (errno == EINTR) continue;
    pid_ = -1;
    fail("wait4", errno);
  }
  if (ended == 0) return std::nullopt;
  pid_ = -1;
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ChildExit{code == 0, code, 1024U * static_cast<std::uint64_t>(usage.ru_maxrss)};
}

ChildExit ChildProcess::wait() { return *collect(0); }
std::optional<ChildExit> ChildProcess::poll() { return collect(WNOHANG); }

void ChildProcess::signal(int number) const {
  if (running()) ::kill(pid_, number);
}

std::string ChildProcess::last_errors() const {
  constexpr off_t kMaxBytes = 600;
  const off_t end = ::lseek(errors_.get(), 0, SEEK_END);
  if (end <= 0) return "no error output";
  const off_t start = end > kMaxBytes ? end - kMaxBytes : 0;
  std::string text(static_cast<std::size_t>(end - start), '\0');
  const ssize_t got = ::pread(errors_.get(), text.data(), text.size(), start);
  text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  const auto cut = std::find_if_not(text.begin(), text.end(), is_continuation);
  if (start > 0) text.erase(text.begin(), cut);  // no part of a character
  while (!text.empty() && text.back() == '\n') text.pop_back();
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos;) text.replace(at, 1, "; ");
  return text;
}

}  // namespace pf
