#include "data/xdmf.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include "core/error.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"

namespace pf {
namespace {

constexpr const char* kHead =
    "<?xml version=\"1.0\" ?>\n<Xdmf Version=\"3.0\">\n<Domain>\n"
    "<Grid Name=\"parcels\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
constexpr const char* kTail = "</Grid>\n</Domain>\n</Xdmf>\n";

struct Slab {
  const char* path;
  const char* type;         // of numbers
  std::uint64_t num_parts;  // 1 or 3 for each parcel
};

// A frame of a data set of [frames][parcels][parts].
std::string slab_text(const XdmfFile::Layout& layout, const Slab& slab, std::uint64_t frame,
                      std::uint64_t num_frames) {
  const bool is_vector = slab.num_parts > 1;
  const std::string parts = is_vector ? fmt::format(" {}", slab.num_parts) : "";
  const char* zeros = is_vector ? " 0 0" : " 0";
  const char* ones = is_vector ? "1 1 1" : "1 1";
  return fmt::format(
      "<DataItem ItemType=\"HyperSlab\" Dimensions=\"{n}{parts}\"><DataItem Dimensions=\"3 {rank}\" "
      "Format=\"XML\">"
      "{frame}{zeros} {ones} 1 {n}{parts}</DataItem><DataItem Dimensions=\"{frames} {n}{parts}\" {type} "
      "Format=\"HDF\">{file}:{path}</DataItem></DataItem>",
      fmt::arg("n", layout.num_parcels), fmt::arg("parts", parts), fmt::arg("rank", is_vector ? 3 : 2),
      fmt::arg("frame", frame), fmt::arg("zeros", zeros), fmt::arg("ones", ones),
      fmt::arg("frames", num_frames), fmt::arg("type", slab.type), fmt::arg("file", xml_text(layout.h5_name)),
      fmt::arg("path", slab.path));
}

constexpr const char* kFloat = "NumberType=\"Float\" Precision=\"4\"";

}  // namespace

bool is_xdmf(const std::filesystem::path& file) {
  std::string start(std::strlen(kHead), '\0');
  std::ifstream(file, std::ios::binary).read(start.data(), static_cast<std::streamsize>(start.size()));
  return start == kHead;
}

// The file is whole from its first moment on, whenever the program is killed.
XdmfFile::XdmfFile(const std::filesystem::path& file, Layout layout)
    : name_(file.string()), layout_(std::move(layout)) {
  const std::string problem = replace_file(file, std::string(kHead) + kTail);
  if (!problem.empty()) fail(problem);
  stream_ = Descriptor(::open(file.c_str(), O_WRONLY | O_CLOEXEC));
  if (!stream_.is_open()) fail(std::strerror(errno));
  end_ = static_cast<std::int64_t>(std::strlen(kHead));
}

void XdmfFile::fail(const std::string& reason) const {
  throw UserError(fmt::format("{}: cannot be written: {}", in_quotes(name_), reason));
}

void XdmfFile::put(const std::string& text) {
  const bool is_there = stream_.is_open() && ::lseek(stream_.get(), end_, SEEK_SET) == end_;
  if (is_there && stream_.write(text.data(), text.size())) return;
  const int error = errno;
  // The disk may be full: what was there before has its place, and is written once more.
  if (::lseek(stream_.get(), end_, SEEK_SET) == end_ && stream_.write(kTail, std::strlen(kTail)))
    static_cast<void>(::ftruncate(stream_.get(), end_ + static_cast<std::int64_t>(std::strlen(kTail))));
  fail(std::strerror(error));
}

void XdmfFile::add_frame(double time_s, std::uint64_t num_frames) {
  const std::uint64_t frame = num_frames - 1;
  std::string text = fmt::format(
      "<Grid Name=\"parcels\"><Time Value=\"{}\"/><Topology TopologyType=\"Polyvertex\" "
      "NodesPerElement=\"1\" "
      "NumberOfElements=\"{}\"/>\n<Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
      time_s, layout_.num_parcels,
      slab_text(layout_, {"/particles/parcels/position/value", kFloat, 3}, frame, num_frames));
  if (layout_.has_velocity) {
    text +=
        fmt::format("<Attribute Name=\"velocity\" AttributeType=\"Vector\" Center=\"Node\">{}</Attribute>\n",
                    slab_text(layout_, {"/particles/parcels/velocity/value", kFloat, 3}, frame, num_frames));
  }
  text += fmt::format(
      "<Attribute Name=\"present\" AttributeType=\"Scalar\" Center=\"Node\">{}</Attribute>\n",
      slab_text(layout_, {"/particles/parcels/present/value", "NumberType=\"UChar\" Precision=\"1\"", 1},
                frame, num_frames));
  text += "</Grid>\n";
  put(text + kTail);
  end_ += static_cast<std::int64_t>(text.size());
}

}  // namespace pf
