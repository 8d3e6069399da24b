// Owner of a file descriptor.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <utility>

namespace pf {

class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}  // negative: none
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() { close(); }

  int get() const { return fd_; }
  bool is_open() const { return fd_ >= 0; }
  // Returns false, and errno has the reason, if closing failed.
  bool close() { return fd_ < 0 || ::close(std::exchange(fd_, -1)) == 0; }
  // Writes all of it. Returns false, and errno has the reason, if that failed.
  bool write(const void* data, std::size_t num_bytes) const {
    const char* next = static_cast<const char*>(data);
    while (num_bytes > 0) {
      const ssize_t written = ::write(fd_, next, num_bytes);
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return false;
      next += written;
      num_bytes -= static_cast<std::size_t>(written);
    }
    return true;
  }

 private:
  int fd_;
};

}  // namespace pf
