#include "data/read_start.hpp"

#include <fmt/format.h>

#include "app/input_log.hpp"
#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/text.hpp"
#include "data/checkpoint_file.hpp"
#include "data/dump.hpp"

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

}  // namespace

void read_start(Options& options) {
  DataOptions& data = options.data;
  if (data.from.empty()) return;
  try {
    auto state = std::make_shared<RunState>(read_state(data));
    apply_edits(data.from_edits, state->settings, "--from");
    check_settings(state->settings, "--from");
    options.settings = state->settings;
    data.start = std::move(state);
  } catch (const UserError& error) {
    const std::string reason = error.what();
    throw UserError(reason.starts_with("--from") ? reason : "--from: " + reason);
  }
}

}  // namespace pf
