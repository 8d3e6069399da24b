#include "app/flight_history.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace pf {
namespace {

// As "air.restitution = 0.5, run.method = exact".
std::string differences(const Settings& from, const Settings& to) {
  std::string text;
  for (const Field& field : fields()) {
    const std::string value = value_text(field, to);
    if (value == value_text(field, from)) continue;
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", field.path(), value);
  }
  return text;
}

}  // namespace

void FlightHistory::begin(double time_s) {
  *this = {};
  begin_s_ = time_s;
}

void FlightHistory::pass_frame(const FlownFrame& frame) {
  if (position_ == latest()) frames_.push_back(frame);
  ++position_;
}

void FlightHistory::change(const Settings& from, const Settings& to) {
  drop_future();
  changes_.push_back({position_, to, differences(from, to)});
  num_changes_ = changes_.size();
}

void FlightHistory::go_to(std::int64_t frame, std::size_t num_changes) {
  position_ = frame;
  num_changes_ = num_changes;
}

void FlightHistory::drop_future() {
  if (position_ < latest()) has_ended_ = false;
  frames_.resize(static_cast<std::size_t>(position_));
  changes_.resize(num_changes_);
}

const FlownFrame* FlightHistory::next_frame() const {
  return position_ < latest() ? &frames_[static_cast<std::size_t>(position_)] : nullptr;
}

const SettingsChange* FlightHistory::next_change() const {
  if (num_changes_ == changes_.size() || changes_[num_changes_].frame > position_) return nullptr;
  return &changes_[num_changes_];
}

const Settings& FlightHistory::settings_at(std::int64_t frame, const Settings& here) const {
  const Settings* last = &here;
  for (std::size_t i = num_changes_; i < changes_.size() && changes_[i].frame <= frame; ++i)
    last = &changes_[i].settings;
  return *last;
}

double FlightHistory::time_at(std::int64_t frame) const {
  return frame == 0 ? begin_s_ : frames_[static_cast<std::size_t>(frame - 1)].time_s;
}

// A frame that was flown in several pictures ends a rounding earlier or later.
std::int64_t FlightHistory::frame_at(double time_s) const {
  constexpr double kTolerance = 1e-9;
  time_s += kTolerance * (time_at(latest()) - begin_s_);
  const auto after =
      std::upper_bound(frames_.begin(), frames_.end(), time_s,
                       [](double time, const FlownFrame& frame) { return time < frame.time_s; });
  return after - frames_.begin();
}

}  // namespace pf
