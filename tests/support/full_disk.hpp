// A full disk, for tests of what is left of a file.
#pragma once

#include <sys/resource.h>

#include <csignal>
#include <cstdint>

namespace pf::test {

// Until the end of the scope no file of this process grows beyond so many bytes.
class FullDisk {
 public:
  explicit FullDisk(std::uintmax_t max_bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit room = {max_bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &room);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  void (*handler_)(int);
  rlimit before_{};
};

}  // namespace pf::test
