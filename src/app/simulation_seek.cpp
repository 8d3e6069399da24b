// Jumps of a simulation within its flight: kept checkpoints, and what lies between them flown again.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "app/command_queue.hpp"
#include "app/simulation_state.hpp"

namespace pf {
namespace {

constexpr double kBack_s = 1.0;  // of display

}  // namespace

void Simulation::State::keep_checkpoint_when_due() {
  if (!checkpoints || history.is_past() || !checkpoints->is_due(shown_s, physics.parcels.num)) return;
  Checkpoint now;
  now.frame = history.position();
  now.num_changes = history.num_changes();
  try {
    save(now);
    checkpoints->keep(std::move(now));
  } catch (const std::exception&) {  // for lack of memory; if it is more the next step tells it
    checkpoints->stop();
  }
}

void Simulation::State::restore(const Checkpoint& then) {
  frame.reset();
  view.mid_step = false;
  if (then.settings.threads != settings.threads) change_threads(then.settings);
  resume(then);
  ghosts = ghosts_of_flight(settings);
  landed_for_s = 0.0;
  ++view.num_recalls;
  history.go_to(then.frame, then.num_changes);
}

// Goes back by a second of display. Keeps the current settings; during a seek, those of its target. If they
// differ from the flight's own there, the flight continues with them.
void Simulation::State::go_back() {
  const auto frames = static_cast<std::int64_t>(std::llround(kBack_s * settings.frame_rate_hz));
  const std::int64_t from = sought.value_or(history.position());
  const Settings kept = settings_at_sought.value_or(history.settings_at(from, settings));
  start_seek(std::max<std::int64_t>(from - frames, 0));
  settings_at_sought = kept;
}

void Simulation::State::seek(double time_s) {
  start_seek(history.frame_at(time_s));
  settings_at_sought.reset();
}

// Throws UserError, without any change, if there is no moment to start from.
void Simulation::State::start_seek(std::int64_t target) {
  const Checkpoint* from = checkpoints ? checkpoints->newest_until(target) : nullptr;
  if (from == nullptr) {
    const bool too_many = checkpoints && checkpoints->max_count(physics.parcels.num) == 0;
    throw UserError(too_many ? "back: there is no checkpoint with so many parcels; give fewer"
                             : "back: there is no checkpoint yet; let it run");
  }
  if (!history.is_past()) {
    latest_flight = flight;
    if (physics.ball.exists && !flight.end_energy_j)
      latest_flight->end_energy_j = backend->measure().energy_j();
  }
  const bool is_before = history.position() < target || (history.position() == target && !frame);
  const bool goes_on = is_before && from->frame <= history.position();
  if (!goes_on) restore(*from);
  sought = target;
}

// Repeats the changes of settings that were made at this frame.
void Simulation::State::repeat_changes() {
  while (const SettingsChange* change = history.next_change()) {
    const Settings to = change->settings;
    history.pass_change();
    apply_settings(to);
    ++view.num_recalls;
  }
}

// Flies whole frames to the frame sought, for the time of the budget.
void Simulation::State::fly_to_sought(DrawTarget* target) {
  const Clock::time_point start = Clock::now();
  const double budget_ms = budget_share * settings.frame_budget_ms;
  while (history.position() < *sought) {
    if (!frame) begin_steps({});
    if (frame->num_done < frame->num_steps) {
      submit_steps(nullptr);
      collect_steps();
    } else {
      end_frame();
    }
    if (budget_ms > 0.0 && milliseconds_since(start) > budget_ms) break;
  }
  if (history.position() == *sought) end_seek();
  view.times = {};
  view.frame_totals = {};
  if (target) draw_again(*target);
}

// Changes that were made there belong to the state.
void Simulation::State::end_seek() {
  sought.reset();
  repeat_changes();
  ++view.num_flights;
  ++view.num_recalls;
  const std::optional<Settings> wanted = std::exchange(settings_at_sought, std::nullopt);
  if (wanted && !(*wanted == settings)) change_settings(*wanted);
}

void Simulation::State::change_settings(const Settings& wanted) {
  const Settings before = settings;
  apply_settings(wanted);
  note_change(before);
}

// Settings changed in the past: the flight goes on from here with them, and what came later is forgotten.
void Simulation::State::note_change(const Settings& before) {
  if (settings == before) return;
  if (history.is_past()) {
    view.notice =
        fmt::format("The flight goes on from here with the change; {:.2f} s to {:.2f} s are dropped",
                    history.time_at(history.position()), history.time_at(history.latest()));
    drop_future();
  }
  history.change(before, settings);
}

void Simulation::State::drop_future() {
  if (!history.is_past()) return;
  latest_flight.reset();
  if (checkpoints) checkpoints->drop_after(history.position(), history.num_changes());
  history.drop_future();
}

Settings Simulation::State::at_target(const Settings& edited_here) const {
  Settings there = settings_at_sought.value_or(history.settings_at(*sought, settings));
  for (const Field& field : fields()) {
    if (!is_same(field, edited_here, settings)) copy_field(field, edited_here, there);
  }
  return there;
}

// Input waits until the flight is where it is sought. Only a new target or a new start is admitted at once. A
// new start keeps the settings of the frame sought.
Commands Simulation::State::admit_while_seeking() {
  const bool anew = starts_anew(waiting) && can_start_anew();
  const bool seeks = (waiting.seek_s || waiting.back) && !settings_at_sought;
  if (anew) {
    const Settings kept = settings_at_sought.value_or(history.settings_at(*sought, settings));
    sought.reset();
    settings_at_sought.reset();
    frame.reset();
    apply_settings(kept);
    return std::exchange(waiting, {});
  }
  Commands now;
  if (!seeks) return now;
  now.hold = waiting.hold;
  now.seek_s = std::exchange(waiting.seek_s, std::nullopt);
  now.back = std::exchange(waiting.back, false);
  return now;
}

}  // namespace pf
