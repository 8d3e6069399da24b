// HDF5's C API with owners of its handles. Failed calls throw DeviceError. One thread at a time: the library
// of the distributions has no locks.
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace pf::h5 {

// Throws DeviceError with HDF5's own reason if the result of a call is negative.
hid_t checked(hid_t result, const char* what);

class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle() = default;
  Handle(hid_t id, Close close, const char* what) : id_(checked(id, what)), close_(close) {}
  ~Handle() { reset(); }
  Handle(Handle&& o) noexcept : id_(std::exchange(o.id_, -1)), close_(o.close_) {}
  Handle& operator=(Handle&& o) noexcept {
    std::swap(id_, o.id_);
    std::swap(close_, o.close_);
    return *this;
  }

  hid_t id() const { return id_; }
  // Closes; returns false if that failed.
  bool reset() { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

Handle make_group(hid_t parent, const std::string& name);
// The group of that path; those that are missing on the way are made.
Handle make_groups(hid_t parent, const std::string& path);
Handle open_dataset(hid_t parent, const std::string& path);
bool exists(hid_t parent, const std::string& path);  // each group on the way, too
std::vector<hsize_t> extent_of(hid_t dataset);

void put_attribute(hid_t object, const char* name, const std::string& text);  // of variable length
void put_attribute(hid_t object, const char* name, const std::vector<std::string>& texts);
void put_attribute(hid_t object, const char* name, const std::vector<int>& values);

void put_value(hid_t parent, const char* name, const std::string& text);
void put_value(hid_t parent, const char* name, double value);
void put_value(hid_t parent, const char* name, std::int64_t value);
void put_numbers(hid_t parent, const char* name, const std::vector<std::uint32_t>& values);
std::string text_value(hid_t parent, const std::string& path);

// A type of texts of a fixed length.
Handle text_type(std::size_t num_bytes);

// Sets `read` to the row of a data set whose first dimension counts frames. Throws DeviceError unless the
// others are those given.
void read_row(hid_t parent, const std::string& path, std::uint64_t row, const std::vector<hsize_t>& extent,
              hid_t type, void* read);

// Reads a data set that holds one value.
std::int64_t number_value(hid_t parent, const std::string& path);

}  // namespace pf::h5
