#include "app/replay.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/error.hpp"

namespace pf {

std::int64_t Replay::num_frames() const { return log_.frames.empty() ? 0 : log_.frames.back().number + 1; }

Commands Replay::commands(const Settings& current) const {
  Commands commands;
  for (std::size_t i = next_; i < log_.frames.size() && log_.frames[i].number == num_frames_; ++i) {
    const LoggedFrame& frame = log_.frames[i];
    if (frame.restart) commands.restart = frame.restart;
    if (frame.fly) commands.fly = frame.fly;
    if (frame.compare != Comparison::none) commands.compare = frame.compare;
    if (frame.method) commands.next_method = frame.method;
    if (frame.seek_s) commands.seek_s = frame.seek_s;
    if (frame.max_steps) commands.max_steps = frame.max_steps;
    if (frame.second.split) commands.split = frame.second.split;
    if (frame.second.max_steps) commands.second_max_steps = frame.second.max_steps;
    commands.time_scale_factor *= frame.time_scale_factor;
    if (!frame.edits.empty()) {
      if (!commands.settings) commands.settings = current;
      apply_edits(frame.edits, *commands.settings, "replay");
    }
    for (const CommandSwitch& one : command_switches()) {
      for (const std::string& name : frame.presses) commands.*one.member |= name == one.name;
    }
  }
  return commands;
}

void Replay::check_start(Simulation& simulation) const {
  if (log_.from_hash.empty() || log_.from_hash == hash_of(simulation)) return;
  throw UserError(fmt::format(
      "replay: {} holds another state than the one that this run went on from; it was replaced since",
      log_.from.string()));
}

void Replay::end_frame(Simulation& simulation, Simulation* second) {
  for (; next_ < log_.frames.size() && log_.frames[next_].number == num_frames_; ++next_) {
    const LoggedFrame& frame = log_.frames[next_];
    compare(frame.hash, &simulation);
    compare(frame.second.hash, second);
  }
  ++num_frames_;
}

void Replay::compare(const std::string& expected, Simulation* flight) {
  if (expected.empty() || diverged()) return;
  ++num_checks_;
  const std::string found = flight == nullptr ? "no second flight" : hash_of(*flight);
  if (found == expected) {
    last_same_ = num_frames_;
    return;
  }
  frame_ = num_frames_;
  expected_ = expected;
  found_ = found;
}

std::string Replay::summary() const {
  const std::string version =
      log_.version == PF_VERSION ? "" : fmt::format(" (log of version {})", log_.version);
  if (diverged()) {
    const std::string before =
        last_same_ < 0 ? "no state before it was compared" : fmt::format("frame {} was the same", last_same_);
    return fmt::format("replay: diverged{}: frame {} has state {} where the log has {}; {}", version, frame_,
                       found_, expected_, before);
  }
  if (num_checks_ == 0)
    return fmt::format("replay: {} frame{}, no state in the log to compare", num_frames_,
                       num_frames_ == 1 ? "" : "s");
  return fmt::format("replay: the same flight{}: {} state{} of {} frame{} compared, the last of frame {}",
                     version, num_checks_, num_checks_ == 1 ? "" : "s", num_frames_,
                     num_frames_ == 1 ? "" : "s", last_same_);
}

nlohmann::json Replay::report() const {
  nlohmann::json report = {{"frames", num_frames()},
                           {"flown", num_frames_},
                           {"checks", num_checks_},
                           {"same", !diverged()},
                           {"first_divergence", nullptr}};
  if (!diverged()) return report;
  report["first_divergence"] = {{"frame", frame_}, {"expected", expected_}, {"found", found_}};
  report["first_divergence"]["last_same_frame"] =
      last_same_ < 0 ? nlohmann::json(nullptr) : nlohmann::json(last_same_);
  return report;
}

}  // namespace pf
