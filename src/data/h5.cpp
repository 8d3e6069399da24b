#include "data/h5.hpp"

#include <algorithm>

#include "core/error.hpp"

namespace pf::h5 {
namespace {

// Files are closed where they are used. What the library does at exit would fail once more for a file whose
// disk is full, with messages of its own.
[[maybe_unused]] const herr_t kNothingAtExit = H5dont_atexit();

// The innermost reason.
herr_t keep_reason(unsigned depth, const H5E_error2_t* error, void* reason) {
  if (depth == 0 && error->desc != nullptr) *static_cast<std::string*>(reason) = error->desc;
  return 0;
}

std::string last_reason() {
  std::string reason;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_reason, &reason);
  H5Eclear2(H5E_DEFAULT);
  if (reason.empty()) return "no reason given";
  // The system's reason stands in: ... errno = 28, error message = 'No space left on device', ...
  const std::string quote = "error message = '";
  if (const std::size_t found = reason.find(quote); found != std::string::npos) {
    const std::size_t begin = found + quote.size();
    return reason.substr(begin, reason.find('\'', begin) - begin);
  }
  std::replace(reason.begin(), reason.end(), '\n', ' ');
  return reason;
}

Handle scalar() { return {H5Screate(H5S_SCALAR), H5Sclose, "scalar"}; }

Handle list_of(std::size_t count) {
  const hsize_t size = count;
  return {H5Screate_simple(1, &size, nullptr), H5Sclose, "list"};
}

Handle any_text_type() {
  Handle type = text_type(1);
  checked(H5Tset_size(type.id(), H5T_VARIABLE), "text type");
  return type;
}

void write_attribute(hid_t object, const char* name, hid_t type, const Handle& space, const void* data) {
  const Handle attribute(H5Acreate2(object, name, type, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         name);
  checked(H5Awrite(attribute.id(), type, data), name);
}

void write_value(hid_t parent, const char* name, hid_t type, const void* data) {
  const Handle dataset(H5Dcreate2(parent, name, type, scalar().id(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                       H5Dclose, name);
  checked(H5Dwrite(dataset.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), name);
}

Handle open_value(hid_t parent, const std::string& path) {
  Handle dataset = open_dataset(parent, path);
  if (!extent_of(dataset.id()).empty()) throw DeviceError("HDF5: " + path + ": has several values");
  return dataset;
}

}  // namespace

hid_t checked(hid_t result, const char* what) {
  if (result >= 0) return result;
  throw DeviceError(std::string("HDF5: ") + what + ": " + last_reason());
}

Handle make_group(hid_t parent, const std::string& name) {
  return {H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose, name.c_str()};
}

Handle make_groups(hid_t parent, const std::string& path) {
  for (std::size_t end = path.find('/'); true; end = path.find('/', end + 1)) {
    const std::string part = path.substr(0, end);
    if (!exists(parent, part)) make_group(parent, part);
    if (end == std::string::npos)
      return {H5Gopen2(parent, path.c_str(), H5P_DEFAULT), H5Gclose, path.c_str()};
  }
}

Handle open_dataset(hid_t parent, const std::string& path) {
  return {H5Dopen2(parent, path.c_str(), H5P_DEFAULT), H5Dclose, path.c_str()};
}

bool exists(hid_t parent, const std::string& path) {
  for (std::size_t end = path.find('/', 1); true; end = path.find('/', end + 1)) {
    if (H5Lexists(parent, path.substr(0, end).c_str(), H5P_DEFAULT) <= 0) return false;
    if (end == std::string::npos) return true;
  }
}

std::vector<hsize_t> extent_of(hid_t dataset) {
  const Handle space(H5Dget_space(dataset), H5Sclose, "extent");
  std::vector<hsize_t> extent(static_cast<std::size_t>(std::max(0, H5Sget_simple_extent_ndims(space.id()))));
  H5Sget_simple_extent_dims(space.id(), extent.data(), nullptr);
  return extent;
}

Handle text_type(std::size_t num_bytes) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "text type");
  checked(H5Tset_size(type.id(), num_bytes), "text type");
  checked(H5Tset_cset(type.id(), H5T_CSET_UTF8), "text type");
  return type;
}

void put_attribute(hid_t object, const char* name, const std::string& text) {
  const char* data = text.c_str();
  write_attribute(object, name, any_text_type().id(), scalar(), &data);
}

void put_attribute(hid_t object, const char* name, const std::vector<std::string>& texts) {
  std::vector<const char*> data;
  for (const std::string& text : texts) data.push_back(text.c_str());
  write_attribute(object, name, any_text_type().id(), list_of(data.size()), data.data());
}

void put_attribute(hid_t object, const char* name, const std::vector<int>& values) {
  write_attribute(object, name, H5T_NATIVE_INT, values.size() == 1 ? scalar() : list_of(values.size()),
                  values.data());
}

void put_value(hid_t parent, const char* name, const std::string& text) {
  const char* data = text.c_str();
  write_value(parent, name, any_text_type().id(), &data);
}

void put_value(hid_t parent, const char* name, double value) {
  write_value(parent, name, H5T_NATIVE_DOUBLE, &value);
}

void put_value(hid_t parent, const char* name, std::int64_t value) {
  write_value(parent, name, H5T_NATIVE_INT64, &value);
}

void put_numbers(hid_t parent, const char* name, const std::vector<std::uint32_t>& values) {
  const Handle dataset(H5Dcreate2(parent, name, H5T_NATIVE_UINT32, list_of(values.size()).id(), H5P_DEFAULT,
                                  H5P_DEFAULT, H5P_DEFAULT),
                       H5Dclose, name);
  if (!values.empty())
    checked(H5Dwrite(dataset.id(), H5T_NATIVE_UINT32, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), name);
}

std::int64_t number_value(hid_t parent, const std::string& path) {
  const Handle dataset = open_value(parent, path);
  std::int64_t value = 0;
  checked(H5Dread(dataset.id(), H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value), path.c_str());
  return value;
}

std::string text_value(hid_t parent, const std::string& path) {
  const Handle dataset = open_value(parent, path);
  const Handle type = any_text_type();
  char* data = nullptr;
  checked(H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, static_cast<void*>(&data)),
          path.c_str());
  const std::string text = data == nullptr ? "" : data;
  H5free_memory(data);
  return text;
}

void read_row(hid_t parent, const std::string& path, std::uint64_t row, const std::vector<hsize_t>& extent,
              hid_t type, void* read) {
  const Handle dataset = open_dataset(parent, path);
  std::vector<hsize_t> count = extent_of(dataset.id());
  std::vector<hsize_t> start(count.size(), 0);
  if (count.empty() || row >= count[0]) throw DeviceError("HDF5: " + path + ": the frame is missing");
  if (!std::equal(count.begin() + 1, count.end(), extent.begin(), extent.end()))
    throw DeviceError("HDF5: " + path + ": a frame has another shape");
  count[0] = 1;
  start[0] = row;
  const Handle in_file(H5Dget_space(dataset.id()), H5Sclose, path.c_str());
  checked(H5Sselect_hyperslab(in_file.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr),
          path.c_str());
  const Handle in_memory(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), H5Sclose,
                         path.c_str());
  checked(H5Dread(dataset.id(), type, in_memory.id(), in_file.id(), H5P_DEFAULT, read), path.c_str());
}

}  // namespace pf::h5
