#include "data/h5_dump.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <list>
#include <optional>

#include "app/frame_names.hpp"
#include "core/replace_file.hpp"
#include "data/h5_fields.hpp"
#include "data/h5_file.hpp"
#include "data/h5_layout.hpp"
#include "data/run_state_json.hpp"
#include "data/xdmf.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

bool is_same_world(const World& a, const World& b) {
  return a.half == b.half && a.unit_m == b.unit_m && a.boundary == b.boundary;
}

constexpr Vec2i kNowhere{kRetired, 0};

}  // namespace

// Numbers of a frame in the form of the file.
struct H5Frame {
  std::vector<float> position, velocity;
  std::vector<std::uint8_t> present, heated;
  std::int64_t num_present = 0;
  double speed2_sum = 0.0;  // of those that are present

  void take(const RunState& state, const DumpLayout& layout);
};

void H5Frame::take(const RunState& state, const DumpLayout& layout) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const ParcelSnapshot& parcels = state.backend.parcels;
  position.assign(3 * layout.num_rows(), kNan);
  velocity.assign(3 * layout.num_rows(), 0.0F);
  present.assign(layout.num_rows(), 0);
  heated.assign(layout.num_rows(), 0);
  for (const std::uint32_t id : parcels.heated) heated[id] = 1;
  num_present = 0;
  speed2_sum = 0.0;
  for (std::size_t i = 0; i < parcels.position.size(); ++i) {
    const Vec2f v = parcels.velocity[i];
    velocity[3 * i] = v.x;
    velocity[3 * i + 1] = v.y;
    if (is_retired(parcels.position[i])) continue;
    speed2_sum += dot(to_double(v), to_double(v));
    const Vec2f at = to_float(to_metres(layout.physics.world, parcels.position[i]));
    position[3 * i] = at.x;
    position[3 * i + 1] = at.y;
    position[3 * i + 2] = 0.0F;
    present[i] = 1;
    ++num_present;
  }
}

// One file with its XDMF file.
class H5DumpFile {
 public:
  H5DumpFile(const fs::path& file, const RunState& first, const DumpFormat& format);

  // Returns whether the state can be a further frame of this file.
  bool continues(const RunState& state) const;
  void add(const RunState& state);
  void finish();
  std::uint64_t num_bytes() const { return file_->num_bytes(); }

 private:
  void open(const char* path, hid_t type) { series_.push_back({path, h5::Series(file_->id(), path, type)}); }
  void open_series();
  void put(const char* path, const void* row);
  void put_parcels(const BackendState& state);
  void put_observables(const RunState& state);
  std::uint64_t frame_bytes() const;

  struct Named {
    std::string path;
    h5::Series series;
  };
  DumpLayout layout_;
  std::vector<std::string> settings_;
  h5::Handle run_type_ = h5::text_type(kRunTextBytes);
  std::optional<h5::GrowingFile> file_;
  std::optional<XdmfFile> xdmf_;
  std::list<Named> series_;
  H5Frame frame_;
  std::vector<std::uint32_t> no_ticks_;
  std::uint64_t num_frames_ = 0, last_step_ = 0;
};

H5DumpFile::H5DumpFile(const fs::path& file, const RunState& first, const DumpFormat& format)
    : layout_(layout_for(first, format)), settings_(settings_lines(first.settings)) {
  file_.emplace(file, [this](hid_t id) { fill_dump(id, layout_); });
  fs::path beside = file;
  beside.replace_extension(".xdmf");
  xdmf_.emplace(beside, XdmfFile::Layout{file.filename().string(), layout_.num_parcels, format.has_velocity});
  open_series();
}

void H5DumpFile::open_series() {
  namespace path = dump_path;
  open(path::kPosition, H5T_NATIVE_FLOAT);
  open(path::kStep, H5T_NATIVE_INT64);
  open(path::kTime, H5T_NATIVE_DOUBLE);
  open(path::kEdges, H5T_NATIVE_DOUBLE);
  open(path::kPresent, H5T_NATIVE_UINT8);
  if (layout_.format.has_velocity) open(path::kVelocity, H5T_NATIVE_FLOAT);
  if (layout_.format.has_state) {
    open(path::kUnits, H5T_NATIVE_INT32);
    open(path::kHeated, H5T_NATIVE_UINT8);
  }
  if (layout_.has_exact) open(path::kAnchor, H5T_NATIVE_INT32);
  if (layout_.has_exact) open(path::kTick, H5T_NATIVE_UINT32);
  if (layout_.has_contact_ticks) open(path::kContactTick, H5T_NATIVE_UINT32);
  for (const char* number : {path::kNumPresent, path::kCollisions, path::kHits})
    open(number, H5T_NATIVE_INT64);
  open(path::kEnergy, H5T_NATIVE_DOUBLE);
  open(path::kHash, H5T_NATIVE_UINT64);
  open(path::kRun, run_type_.id());
  if (!layout_.physics.ball.exists) return;
  for (const char* number : {path::kBallPosition, path::kBallVelocity, path::kBallSpin})
    open(number, H5T_NATIVE_DOUBLE);
}

void H5DumpFile::put(const char* path, const void* row) {
  const auto found =
      std::find_if(series_.begin(), series_.end(), [&](const Named& one) { return one.path == path; });
  if (found != series_.end()) found->series.append(row);
}

bool H5DumpFile::continues(const RunState& state) const {
  const DumpLayout other = layout_for(state, layout_.format);
  const bool has_room = run_state_text(state, settings_).size() < kRunTextBytes;
  return other.num_parcels == layout_.num_parcels &&
         is_same_world(other.physics.world, layout_.physics.world) &&
         other.physics.parcels.radius_m == layout_.physics.parcels.radius_m &&
         other.physics.parcels.mass_kg == layout_.physics.parcels.mass_kg &&
         other.physics.ball.exists == layout_.physics.ball.exists &&
         (!other.has_exact || (layout_.has_exact && layout_.has_contact_ticks == other.has_contact_ticks)) &&
         has_room && (num_frames_ == 0 || state.totals.num_steps > last_step_);
}

// Parcels without trajectories, as before the first step, have their positions for anchors.
void H5DumpFile::put_parcels(const BackendState& state) {
  const ParcelSnapshot& parcels = state.parcels;
  const ExactSnapshot& exact = state.exact;
  const Vec2i* positions = layout_.num_parcels == 0 ? &kNowhere : parcels.position.data();
  no_ticks_.resize(layout_.num_rows());
  const bool has_trajectories = exact.active && layout_.num_parcels > 0;
  put(dump_path::kPresent, frame_.present.data());
  put(dump_path::kVelocity, frame_.velocity.data());
  put(dump_path::kUnits, positions);
  put(dump_path::kHeated, frame_.heated.data());
  put(dump_path::kAnchor, has_trajectories ? exact.anchor.data() : positions);
  put(dump_path::kTick, has_trajectories ? exact.tick.data() : no_ticks_.data());
  put(dump_path::kContactTick,
      exact.last_contact_tick.empty() ? no_ticks_.data() : exact.last_contact_tick.data());
}

void H5DumpFile::put_observables(const RunState& state) {
  const BallState& ball = state.backend.ball;
  const Vec2d half = to_metres(layout_.physics.world, layout_.physics.world.half);
  const double depth_m = std::max(2.0 * layout_.physics.parcels.radius_m, 1e-6);
  const double edges[9] = {2.0 * half.x, 0.0, 0.0, 0.0, 2.0 * half.y, 0.0, 0.0, 0.0, depth_m};
  const double energy_j = 0.5 * layout_.physics.parcels.mass_kg * frame_.speed2_sum;
  const auto num_collisions = static_cast<std::int64_t>(state.totals.num_collisions);
  const auto num_hits = static_cast<std::int64_t>(state.totals.num_ball_hits);
  const std::uint64_t hash = state_hash(state);
  std::string run = run_state_text(state, settings_);
  run.resize(kRunTextBytes);
  put(dump_path::kEdges, edges);
  put(dump_path::kBallPosition, &ball.position_m);
  put(dump_path::kBallVelocity, &ball.velocity_mps);
  put(dump_path::kBallSpin, &ball.spin_radps);
  put(dump_path::kEnergy, &energy_j);
  put(dump_path::kNumPresent, &frame_.num_present);
  put(dump_path::kCollisions, &num_collisions);
  put(dump_path::kHits, &num_hits);
  put(dump_path::kHash, &hash);
  put(dump_path::kRun, run.data());
}

std::uint64_t H5DumpFile::frame_bytes() const {
  constexpr std::uint64_t kMaxBytesPerParcel = 12 + 12 + 1 + 8 + 1 + 8 + 4 + 4;
  return layout_.num_parcels * kMaxBytesPerParcel * 11 / 10 + (1U << 18);
}

// The positions come last: a frame is complete when they are there.
void H5DumpFile::add(const RunState& state) {
  file_->reserve(frame_bytes());
  frame_.take(state, layout_);
  put_parcels(state.backend);
  put_observables(state);
  last_step_ = state.totals.num_steps;
  const auto step = static_cast<std::int64_t>(last_step_);
  put(dump_path::kStep, &step);
  put(dump_path::kTime, &state.simulated_s);
  put(dump_path::kPosition, frame_.position.data());
  ++num_frames_;
  xdmf_->add_frame(state.simulated_s, num_frames_);
}

void H5DumpFile::finish() {
  series_.clear();
  run_type_.reset();
  file_->finish();
}

H5Dump::H5Dump(fs::path file, DumpFormat format) : path_(std::move(file)), format_(format) {}
H5Dump::~H5Dump() = default;

// The user chose only the first name; only that file may be overwritten.
fs::path H5Dump::next_file() {
  if (++number_ == 1) return path_;
  const auto is_taken = [](const fs::path& file) {
    std::error_code ignored;
    return fs::exists(fs::symlink_status(file, ignored));
  };
  fs::path file = numbered(path_, number_);
  while (is_taken(file) || is_taken(part_of(file)) || is_taken(fs::path(file).replace_extension(".xdmf")))
    file = numbered(path_, ++number_);
  return file;
}

void H5Dump::write(const RunState& state) {
  if (file_ && !file_->continues(state)) finish();
  if (!file_) {
    const fs::path file = next_file();
    file_ = std::make_unique<H5DumpFile>(file, state, format_);
    if (file != path_) further_files_.push_back(file);
  }
  file_->add(state);
}

void H5Dump::finish() {
  if (!file_) return;
  num_bytes_before_ += file_->num_bytes();
  file_->finish();
  file_.reset();
}

std::uint64_t H5Dump::num_bytes() const { return num_bytes_before_ + (file_ ? file_->num_bytes() : 0); }

std::unique_ptr<StateSink> make_h5_dump(const fs::path& file, const DumpFormat& format) {
  return std::make_unique<H5Dump>(file, format);
}

}  // namespace pf
