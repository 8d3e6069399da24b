#include "data/run_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"
#include "core/timing.hpp"
#include "data/checkpoint_file.hpp"
#include "data/dump.hpp"
#include "data/xdmf.hpp"
#include "data/xyz_dump.hpp"

namespace pf {
namespace {

// What follows a failure.
constexpr const char *kWithoutIt = "; the run continues without it",
                     *kNextOne = "; the next one is tried as planned";

constexpr std::size_t kHeldFrames = 3;  // of a dump: one that is written, two that wait

class CheckpointSink final : public StateSink {
 public:
  explicit CheckpointSink(std::filesystem::path file) : file_(std::move(file)) {}
  void write(const RunState& state) override { num_bytes_ = write_checkpoint(file_, state); }
  void finish() override {}
  std::uint64_t num_bytes() const override { return num_bytes_; }
  bool begins_anew() const override { return true; }

 private:
  std::filesystem::path file_;
  std::uint64_t num_bytes_ = 0;
};

std::unique_ptr<StateSink> make_dump(const DataOptions& options) {
  if (ending_of(options.dump) == ".xyz") return std::make_unique<XyzDump>(options.dump);
  const auto has = [&](const char* field) {
    return std::find(options.dump_fields.begin(), options.dump_fields.end(), field) !=
           options.dump_fields.end();
  };
  return make_h5_dump(options.dump, {has("velocity"), has("state"), options.dump_compression});
}

// Not an integer, which a very short interval would overflow; infinite for the shortest ones.
double interval_of(double simulated_s, double every_s) {
  return std::floor(simulated_s / every_s * (1.0 + 1e-12) + 1e-9);
}

}  // namespace

void check_replaced(const DataOptions& options) {
  if (holds_something(options.checkpoint) && !is_checkpoint(options.checkpoint))
    throw UserError(
        fmt::format("--checkpoint: {} exists and is no checkpoint, so none replaces it; choose another "
                    "name",
                    in_quotes(options.checkpoint.string())));
  if (ending_of(options.dump) != ".h5") return;
  const std::filesystem::path index = std::filesystem::path(options.dump).replace_extension(".xdmf");
  if (holds_something(index) && !is_xdmf(index))
    throw UserError(
        fmt::format("--dump: its index would replace {}, which is of no dump; choose another name",
                    in_quotes(index.string())));
}

RunFiles::RunFiles(const DataOptions& options, bool may_drop, Announce announce)
    : announce_(std::move(announce)) {
  using WhenFull = StateWriter::WhenFull;
  if (!options.dump.empty()) {
    auto writer = std::make_unique<StateWriter>(make_dump(options), kHeldFrames);
    targets_.push_back({"dump", options.dump, options.dump_every_s, std::move(writer),
                        may_drop ? WhenFull::drop : WhenFull::wait});
  }
  if (!options.checkpoint.empty()) {
    auto writer = std::make_unique<StateWriter>(std::make_unique<CheckpointSink>(options.checkpoint), 1);
    targets_.push_back({"checkpoint", options.checkpoint, options.checkpoint_every_s, std::move(writer),
                        may_drop ? WhenFull::drop : WhenFull::wait});
  }
}

// A checkpoint without an interval is written at the end only.
bool RunFiles::is_due(const Target& target, const FrameView& view) const {
  if (target.last_step == view.totals.num_steps) return false;
  if (target.every_s == 0.0) return target.name == "dump";
  const double interval = interval_of(view.simulated_s, target.every_s);
  return !std::isfinite(interval) || interval != target.last_interval;
}

// The state is copied once, also for two files.
void RunFiles::write(Target& target, const Simulation& simulation, const RunClock& clock) {
  if (target.is_kept) return;
  const FrameView& view = simulation.view();
  if (target.every_s > 0.0) target.last_interval = interval_of(view.simulated_s, target.every_s);
  target.last_step = view.totals.num_steps;
  const bool has_room = target.writer->has_room(target.when_full);
  tell_failure(target, target.name == "dump" ? kWithoutIt : kNextOne);
  if (!has_room) return;
  if (!last_) {
    const Clock::time_point start = Clock::now();
    std::shared_ptr<RunState> state;
    try {
      state = free_state();
      simulation.save(*state);
    } catch (const std::exception& error) {  // for lack of memory; if it is more the next step tells it
      target.writer->fail(fmt::format("the state cannot be copied ({})", reason_of(error)));
      return;
    }
    state->initial = clock.initial;
    state->num_frames = clock.num_frames;
    state->frames_after_flight = clock.frames_after_flight;
    last_ = state;
    save_ms_ += milliseconds_since(start);
  }
  target.writer->add(last_);
}

std::shared_ptr<RunState> RunFiles::free_state() {
  for (const std::shared_ptr<RunState>& state : states_) {
    if (state.use_count() > 1) continue;
    std::atomic_thread_fence(std::memory_order_acquire);  // after what the writer has read of it
    return state;
  }
  return states_.emplace_back(std::make_shared<RunState>());
}

void RunFiles::tell_failure(Target& target, const char* outlook) {
  const std::string failure = target.writer->failure();
  const bool is_news = !failure.empty() && failure != target.told;
  target.told = failure;
  if (is_news && announce_) announce_(fmt::format("--{}: {}{}", target.name, failure, outlook));
}

// Where a device has failed the flight begins anew: the checkpoint of before is worth more than a new one.
void RunFiles::keep_checkpoint(const Simulation& simulation) {
  if (simulation.num_fallbacks() == std::exchange(seen_fallbacks_, simulation.num_fallbacks())) return;
  for (Target& target : targets_) {
    std::error_code ignored;
    const bool was_handed_over = target.last_step != UINT64_MAX;  // it may still be written
    if (target.name != "checkpoint" || !(was_handed_over || std::filesystem::exists(target.file, ignored)))
      continue;
    target.writer->finish();
    target.is_kept = true;
    target.writer->fail(
        fmt::format("{} stays as it was before the device failed", in_quotes(target.file.string())));
    tell_failure(target, kWithoutIt);
  }
}

// The first state after a new scene, a reset or a jump back is always due: it begins a file.
void RunFiles::note_beginning(const FrameView& view) {
  const bool begins = view.num_scenes != seen_scenes_ || view.totals.num_steps < seen_steps_;
  seen_scenes_ = view.num_scenes;
  seen_steps_ = view.totals.num_steps;
  if (!begins) return;
  for (Target& target : targets_) {
    target.last_interval = -1.0;
    target.last_step = UINT64_MAX;
  }
}

void RunFiles::follow(const Simulation& simulation, const RunClock& clock) {
  const FrameView& view = simulation.view();
  last_.reset();
  keep_checkpoint(simulation);
  if (view.unfinished) return;
  note_beginning(view);
  for (Target& target : targets_) {
    if (is_due(target, view)) write(target, simulation, clock);
  }
  last_.reset();
}

// A frame that is worked off in several pictures is completed first.
void RunFiles::finish(Simulation& simulation, const RunClock& clock) {
  last_.reset();
  keep_checkpoint(simulation);
  for (Target& target : targets_) {
    if (target.name == "checkpoint") {
      while (simulation.view().unfinished) simulation.advance_frame({}, nullptr);
      target.when_full = StateWriter::WhenFull::wait;
      target.last_step = UINT64_MAX;
      write(target, simulation, clock);
    }
    target.writer->finish();
    tell_failure(target, "");
    std::string further;
    for (const std::filesystem::path& file : target.writer->further_files())
      further += (further.empty() ? "" : ", ") + in_quotes(file.string());
    if (!further.empty() && announce_)
      announce_(fmt::format("--{}: goes on in {}, where a state did not continue the one before", target.name,
                            further));
    const StateWriter::Counts counts = target.writer->counts();
    if (counts.num_dropped > 0 && announce_) {
      announce_(fmt::format("--{}: {} of {} frames were dropped, because writing took longer than drawing",
                            target.name, counts.num_dropped, counts.num_written + counts.num_dropped));
    }
  }
}

bool RunFiles::failed() const {
  return std::any_of(targets_.begin(), targets_.end(),
                     [](const Target& target) { return !target.writer->failure().empty(); });
}

nlohmann::json RunFiles::report() const {
  nlohmann::json report = {{"dump", nullptr}, {"checkpoint", nullptr}};
  for (const Target& target : targets_) {
    const StateWriter::Counts counts = target.writer->counts();
    nlohmann::json further = nlohmann::json::array();
    for (const std::filesystem::path& file : target.writer->further_files()) further.push_back(file.string());
    report[target.name] = {{"file", target.file.string()},  {"written", counts.num_written},
                           {"dropped", counts.num_dropped}, {"bytes", counts.num_bytes},
                           {"write_ms", counts.write_ms},   {"wait_ms", counts.wait_ms},
                           {"save_ms", save_ms_},           {"failure", target.writer->failure()},
                           {"further_files", further}};
  }
  return report;
}

}  // namespace pf
