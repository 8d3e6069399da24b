// Another program, started without a shell. Its error output is kept for messages.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/descriptor.hpp"

namespace pf {

struct ChildExit {
  bool good = false;                  // exit code 0
  int code = -1;                      // exit code; -1: ended by a signal
  std::uint64_t peak_host_bytes = 0;  // peak of its main memory (ru_maxrss)
};

class ChildProcess {
 public:
  // arguments: the program (searched on the PATH unless it has a slash) and its arguments. input: its
  // standard input; -1: none. Standard output is dropped. The child has a process group of its own, so that
  // Ctrl-C in the terminal reaches this program alone. Throws DeviceError.
  ChildProcess(std::vector<std::string> arguments, int input);
  ~ChildProcess();  // kills a running child
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  bool running() const { return pid_ >= 0; }  // its end has not been collected
  ChildExit wait();                           // until it ends; call once
  std::optional<ChildExit> poll();            // none while it runs; not after its end
  void signal(int number) const;
  // End of its error output, in one line.
  std::string last_errors() const;

 private:
  std::optional<ChildExit> collect(int flags);

  pid_t pid_ = -1;
  Descriptor errors_;  // memory that holds its standard error; unlike a pipe it cannot fill up
};

}  // namespace pf
