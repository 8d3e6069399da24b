// Errors by responsibility. Libraries throw. main turns uncaught errors into one line and an exit code. A run
// that can go on without the failed part (an output, a device, a command) catches the error and reports it.
#pragma once

#include <new>
#include <stdexcept>
#include <string>

namespace pf {

// The user's input cannot be used. The message is one line: place, value, allowed range, remedy. Exit code 2.
class UserError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Results that cannot be written. Exit code 1, as for interrupted runs.
class OutputError : public UserError {
 public:
  using UserError::UserError;
};

// A device, driver or display cannot do what was asked. Exit code 3.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The reason for a line that says what failed; that of std::bad_alloc by itself says nothing.
inline std::string reason_of(const std::exception& error) {
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ? "out of memory" : error.what();
}

}  // namespace pf
