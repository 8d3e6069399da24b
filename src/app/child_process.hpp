// Another program, started without a shell, its complaints kept for the message.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace pf {

// Owner of a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() { close(); }
  int get() const { return fd_; }
  void close();

 private:
  int fd_;
};

struct ChildExit {
  bool good = false;                  // ended by itself with exit code 0
  int code = -1;                      // exit code; -1: ended by a signal
  std::uint64_t peak_host_bytes = 0;  // the most main memory it held (ru_maxrss)
};

class ChildProcess {
 public:
  // arguments: the program (looked up on the PATH unless it has a slash) and what it is given. input: its
  // standard input, -1: none. Standard output is dropped. Runs in a process group of its own: Ctrl-C in the
  // terminal reaches this program only, which decides what becomes of the child. Throws DeviceError.
  ChildProcess(std::vector<std::string> arguments, int input);
  ~ChildProcess();  // kills and waits if nobody waited
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  bool running() const { return pid_ >= 0; }  // nobody has waited for its end yet
  ChildExit wait();                           // until it ends; once
  std::optional<ChildExit> poll();            // none while it works; once
  void signal(int number) const;
  // The last lines that it wrote to standard error, joined to one.
  std::string last_words() const;

 private:
  std::optional<ChildExit> collect(int flags);

  pid_t pid_ = -1;
  Descriptor errors_;  // memory that holds its standard error: no pipe that could fill up
};

}  // namespace pf
