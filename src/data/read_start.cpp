#include "data/read_start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/input_log.hpp"
#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/text.hpp"
#include "data/checkpoint_file.hpp"
#include "data/dump.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

RunState read_state(const DataOptions& data) {
  if (ending_of(data.from) == ".h5" && !is_checkpoint(data.from))
    return read_h5_frame(data.from, data.from_frame);
  if (data.from_frame)
    throw UserError(
        fmt::format("--from-frame: {} is not a dump (.h5); leave it out", in_quotes(data.from.string())));
  return read_checkpoint(data.from);
}

// A tick of method `exact` is so short that everything moves by a fraction of a position unit. Settings may
// have changed the speeds since, so the margin is large; but nothing crosses the world in a tick.
void check_ticks(const RunState& state, const std::filesystem::path& file) {
  const BackendState& backend = state.backend;
  if (!backend.exact.active || backend.exact.tick_exponent == 0) return;
  const TickScale reference = make_run_constants(derive_physics(state.settings), 0.0).reference_ticks;
  const auto exponent = static_cast<int>(backend.exact.tick_exponent);
  const double limit_mps = std::ldexp(static_cast<double>(kHalfSide), -exponent) / reference.units_per_tick;
  const auto is_too_fast = [&](const auto& v) { return std::hypot(v.x, v.y) > limit_mps; };
  if (!std::ranges::any_of(backend.parcels.velocity, is_too_fast) && !is_too_fast(backend.ball.velocity_mps))
    return;
  throw UserError(
      fmt::format("{}: the state of the run is damaged: exact.tick_exponent is {}, too long a tick for its "
                  "speeds; give an earlier checkpoint, or another frame of a dump",
                  in_quotes(file.string()), exponent));
}

}  // namespace

void read_start(Options& options) {
  DataOptions& data = options.data;
  if (data.from.empty()) return;
  try {
    auto state = std::make_shared<RunState>(read_state(data));
    apply_edits(data.from_edits, state->settings, "--from");
    check_settings(state->settings, "--from");
    check_ticks(*state, data.from);
    options.settings = state->settings;
    data.start = std::move(state);
  } catch (const UserError& error) {
    const std::string reason = error.what();
    throw UserError(reason.starts_with("--from") ? reason : "--from: " + reason);
  }
}

}  // namespace pf
