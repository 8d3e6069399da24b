// Stands for the sources that need HDF5 where it was not found.
#include "core/error.hpp"
#include "data/dump.hpp"

namespace pf {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file) {
  throw UserError(file.string() +
                  ": this build has no HDF5; install the package libhdf5-dev, configure and build again");
}

}  // namespace

std::unique_ptr<StateSink> make_h5_dump(const std::filesystem::path& file, const DumpFormat&) {
  refuse(file);
}

RunState read_h5_frame(const std::filesystem::path& file, std::optional<std::int64_t>) { refuse(file); }

}  // namespace pf
