// Data sets of a dump that get a row for each frame.
#pragma once

#include "data/h5.hpp"

namespace pf::h5 {

class Series {
 public:
  // Layout of a series in the file. row: extent of a frame, empty for a number.
  struct Shape {
    hid_t type = -1;
    std::vector<hsize_t> row;
    int compression = 0;
    bool has_nan_fill = false;  // of float32
  };

  // Makes an empty data set.
  static void make(hid_t parent, const std::string& path, const Shape& shape);
  // Opens it for appending. type: of the rows in memory.
  Series(hid_t parent, const std::string& path, hid_t type);

  // Adds a frame and hands all of it to the system.
  void append(const void* row);

 private:
  Handle dataset_, in_memory_;
  hid_t type_ = -1;
  std::vector<hsize_t> extent_;
  std::string path_;
};

}  // namespace pf::h5
