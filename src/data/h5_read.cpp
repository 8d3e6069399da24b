// A frame of a dump as the state of a run.
#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"
#include "core/text.hpp"
#include "data/h5_layout.hpp"
#include "data/run_state_json.hpp"

namespace pf {
namespace {

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file);

  RunState read(std::optional<std::int64_t> wanted);

 private:
  [[noreturn]] void refuse(const std::string& reason, const std::string& remedy) const {
    throw UserError(fmt::format("{}: {}; {}", in_quotes(name_), reason, remedy));
  }
  void check_is_dump() const;
  void check_has_state() const;
  std::uint64_t choose_frame(std::optional<std::int64_t> wanted) const;
  std::string run_text(std::uint64_t frame) const;
  void check_sizes(std::size_t n) const;
  void read_parcels(std::uint64_t frame, std::size_t n, BackendState& state) const;
  void check_hash(std::uint64_t frame, const RunState& state) const;

  std::string name_;
  h5::Handle file_;
};

Reader::Reader(const std::filesystem::path& file) : name_(file.string()) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  try {
    file_ = h5::Handle(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, "file");
  } catch (const DeviceError& error) {
    refuse(fmt::format("cannot be opened as HDF5 ({})", error.what()),
           "give a checkpoint or a dump of this program");
  }
}

void Reader::check_is_dump() const {
  const bool is_dump = h5::exists(file_.id(), dump_path::kFormat) &&
                       h5::exists(file_.id(), dump_path::kSettings) &&
                       h5::exists(file_.id(), dump_path::kRun);
  if (!is_dump) refuse("is no dump of this program", "give a file that --dump has written");
  const std::int64_t format = h5::number_value(file_.id(), dump_path::kFormat);
  if (format != kDumpFormat)
    refuse(fmt::format("has format {}, and this program reads {}", format, kDumpFormat),
           "use the version of the program that wrote it");
}

// Positions in metres are rounded to 24 bits: a run cannot go on from them to the same bits.
void Reader::check_has_state() const {
  if (!h5::exists(file_.id(), dump_path::kUnits))
    refuse("has no exact positions: it was dumped without the field state",
           "dump with --dump-fields position,velocity,state, or give a checkpoint");
  if (!h5::exists(file_.id(), dump_path::kVelocity))
    refuse("has no velocities", "dump with --dump-fields position,velocity,state, or give a checkpoint");
}

std::uint64_t Reader::choose_frame(std::optional<std::int64_t> wanted) const {
  const hsize_t num = h5::extent_of(h5::open_dataset(file_.id(), dump_path::kPosition).id()).at(0);
  if (num == 0) refuse("has no complete frame", "give a checkpoint or another dump");
  if (!wanted) return num - 1;
  if (static_cast<std::uint64_t>(*wanted) >= num)
    refuse(fmt::format("has no frame {}", *wanted), fmt::format("--from-frame takes 0 to {}", num - 1));
  return static_cast<std::uint64_t>(*wanted);
}

std::string Reader::run_text(std::uint64_t frame) const {
  std::string text(kRunTextBytes, '\0');
  h5::read_row(file_.id(), dump_path::kRun, frame, {}, h5::text_type(kRunTextBytes).id(), text.data());
  return text.substr(0, text.find('\0'));
}

void Reader::check_sizes(std::size_t n) const {
  for (const char* path : {dump_path::kPosition, dump_path::kVelocity, dump_path::kUnits, dump_path::kHeated,
                           dump_path::kAnchor, dump_path::kTick, dump_path::kContactTick}) {
    if (!h5::exists(file_.id(), path)) continue;
    const std::vector<hsize_t> extent = h5::extent_of(h5::open_dataset(file_.id(), path).id());
    if (extent.size() < 2 || extent[1] != std::max<hsize_t>(n, 1))
      refuse(fmt::format("is damaged: {} does not have {} parcels", path, n),
             "give a checkpoint or another dump");
  }
}

void Reader::read_parcels(std::uint64_t frame, std::size_t n, BackendState& state) const {
  if (n == 0) return;
  const auto read = [&](const char* path, const std::vector<hsize_t>& extent, hid_t type, auto& to) {
    to.resize(n);
    h5::read_row(file_.id(), path, frame, extent, type, to.data());
  };
  read(dump_path::kUnits, {n, 2}, H5T_NATIVE_INT32, state.parcels.position);
  std::vector<float> velocity(3 * n);
  h5::read_row(file_.id(), dump_path::kVelocity, frame, {n, 3}, H5T_NATIVE_FLOAT, velocity.data());
  state.parcels.velocity.resize(n);
  for (std::size_t i = 0; i < n; ++i) state.parcels.velocity[i] = {velocity[3 * i], velocity[3 * i + 1]};
  std::vector<std::uint8_t> heated;
  read(dump_path::kHeated, {n}, H5T_NATIVE_UINT8, heated);
  for (std::size_t i = 0; i < n; ++i) {
    if (heated[i] != 0) state.parcels.heated.push_back(static_cast<std::uint32_t>(i));
  }
  if (!state.exact.active) return;
  if (!h5::exists(file_.id(), dump_path::kAnchor))
    refuse("lacks the anchors of method exact", "give a checkpoint or another dump");
  read(dump_path::kAnchor, {n, 2}, H5T_NATIVE_INT32, state.exact.anchor);
  read(dump_path::kTick, {n}, H5T_NATIVE_UINT32, state.exact.tick);
  if (h5::exists(file_.id(), dump_path::kContactTick))
    read(dump_path::kContactTick, {n}, H5T_NATIVE_UINT32, state.exact.last_contact_tick);
}

void Reader::check_hash(std::uint64_t frame, const RunState& state) const {
  std::uint64_t hash = 0;
  h5::read_row(file_.id(), dump_path::kHash, frame, {}, H5T_NATIVE_UINT64, &hash);
  if (hash == state_hash(state)) return;
  refuse(fmt::format("is damaged: frame {} does not have the hash that it had", frame),
         "give another --from-frame, or a checkpoint");
}

RunState Reader::read(std::optional<std::int64_t> wanted) {
  check_is_dump();
  check_has_state();
  const std::uint64_t frame = choose_frame(wanted);
  RunState state =
      run_state_from_text(run_text(frame), lines_in(h5::text_value(file_.id(), dump_path::kSettings)), name_);
  const bool has_parcels = state.settings.air == Air::parcels;
  const auto n = static_cast<std::size_t>(has_parcels ? state.settings.num_parcels : 0);
  check_sizes(n);
  read_parcels(frame, n, state.backend);
  check_hash(frame, state);
  if (!state.settings.ball_present) return state;
  state.flight.points_m = {to_float(state.backend.ball.position_m)};
  state.flight.times_s = {state.simulated_s - state.launched_at_s};
  return state;
}

}  // namespace

RunState read_h5_frame(const std::filesystem::path& file, std::optional<std::int64_t> frame) {
  try {
    return Reader(file).read(frame);
  } catch (const DeviceError& error) {
    throw UserError(fmt::format("{}: cannot be read: {}; give a checkpoint or another dump",
                                in_quotes(file.string()), error.what()));
  }
}

}  // namespace pf
