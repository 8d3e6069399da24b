#include "app/flight_pair.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "app/command_queue.hpp"
#include "core/error.hpp"

namespace pf {
namespace {

constexpr double kShareOfBudget = 0.5;  // of each of two flights

// The clocks of both begin at zero again, or are moved.
bool begins_flight(const Commands& c) { return starts_anew(c) || c.fly || c.launch || c.back || c.seek_s; }

double frame_s(const FrameView& flight) {
  const double flown_s = flight.steps_per_frame * flight.dt_s;
  return flown_s > 0.0 ? flown_s : flight.settings->time_scale / flight.settings->frame_rate_hz;
}

// Why settings cannot fly; empty: they can.
std::string refusal_of(Settings edited, const std::string& backend) {
  try {
    edited.num_parcels = resolve_num_parcels(edited, backend);
    check_settings(edited, "panel");
    derive_physics(edited);
    return "";
  } catch (const UserError& error) {
    return error.what();
  }
}

// Two flights begin at the start of the launch: another one, or a jump, has no effect.
void drop_flights(Commands& commands) {
  commands.fly.reset();
  commands.compare = Comparison::none;
  commands.launch = commands.back = false;
  commands.seek_s.reset();
}

}  // namespace

void FlightPair::keep_to_budget() {
  has_budget_ = true;
  first_.keep_to_budget();
}

void FlightPair::keep_checkpoints() {
  has_checkpoints_ = true;
  first_.keep_checkpoints();
  if (second_) second_->keep_checkpoints();
}

bool FlightPair::is_whole() const {
  return !first_.view().unfinished && (!second_ || !second_->view().unfinished);
}

bool FlightPair::finished_flights() const {
  return first_.finished_flight() && (!second_ || second_->finished_flight());
}

Commands FlightPair::admit(const Commands& wanted) {
  if (second_ || wanted.split || changes_anything(waiting_)) return admit_two(wanted);
  if (!only_steps(wanted)) message_.clear();
  is_new_frame_ = first_goes_ = true;
  return first_.admit(wanted);
}

Commands FlightPair::admit_two(const Commands& wanted) {
  const bool is_first_edit = wanted.settings && !waiting_.settings;
  waiting_ = joined(waiting_, wanted);
  if (is_first_edit && first_.view().sought_s) waiting_.settings = first_.at_target(*wanted.settings);
  if (!only_steps(waiting_)) {
    cut(first_);
    if (second_) cut(*second_);
  }
  is_new_frame_ = is_whole();
  first_goes_ = is_new_frame_ || first_.view().unfinished;
  if (!is_new_frame_) {
    Commands none;
    none.hold = !first_goes_;
    return none;
  }
  Commands commands = std::exchange(waiting_, {});
  if (!only_steps(commands)) message_.clear();
  if (second_ && commands.compare != Comparison::none && !follows_log_) {
    commands.split = compared(difference_, commands.compare, first_.settings(), second_->view().dt_s);
    commands.compare = Comparison::none;
  }
  if (!follows_log_) refuse_bad_edits(commands);
  const std::int64_t num_begun_before = num_begun_;
  if (commands.split) change(Difference(*commands.split), commands);
  if (!second_) return first_.admit(commands);
  first_waits_ = !begins_flight(commands) && waits(first_, *second_);
  second_waits_ = !begins_flight(commands) && waits(*second_, first_);
  if (!follows_log_) {
    commands.hold = commands.hold || first_waits_;
    commands.launch = commands.launch && first_.view().physics->ball.exists;
    if (second_->view().paused && !first_.view().paused) commands.toggle_pause = true;  // it paused itself
  }
  Commands admitted = first_.admit(commands);
  if (num_begun_ != num_begun_before) drop_flights(admitted);  // of input that has waited in the first flight
  return admitted;
}

// Ends the frame of a flight after its last whole step, as soon as that is done.
void FlightPair::cut(Simulation& flight) {
  if (!flight.view().unfinished) return;
  Commands nudge;
  nudge.hold = true;
  Commands ended = flight.admit(nudge);
  if (flight.view().unfinished) return;
  if (&flight != &first_) {
    second_cut_ = flight.view().num_done;
    return;
  }
  waiting_ = joined(ended, waiting_);  // what has waited since before there were two
}

// A half waits for the other one where its flight is ahead, or over.
bool FlightPair::waits(const Simulation& flight, const Simulation& other) const {
  const FrameView& here = flight.view();
  const FrameView& there = other.view();
  if (there.flight == Flight::landed) return false;
  if (here.flight == Flight::landed) return true;
  return flight_time_s(here) - flight_time_s(there) > 0.5 * frame_s(here);
}

// Edits that the second flight could not follow are refused for both.
void FlightPair::refuse_bad_edits(Commands& commands) {
  if (!second_ || !commands.settings) return;
  const std::string backend = first_.backend().name();
  const std::string of_second = refusal_of(differing(*commands.settings, difference_), backend);
  if (of_second.empty()) return;
  const std::string of_first = refusal_of(*commands.settings, backend);
  message_ = of_first.empty() ? fmt::format("Second half: {}", of_second) : of_first;
  commands.settings.reset();
}

void FlightPair::change(const Difference& wanted, Commands& commands) {
  if (wanted.empty()) return drop("");
  const bool had_second = second_ != nullptr;
  std::optional<Difference> difference;
  try {
    if (!make_) throw UserError("--split: there is no second flight here");
    const Settings settings = commands.settings.value_or(first_.settings());
    difference = resolved(wanted, settings);
    drop("");  // its memory
    auto backend = make_(first_.backend().name(), settings.threads);
    second_ = std::make_unique<Simulation>(differing(settings, *difference), std::move(backend));
    difference_ = *difference;
    measure_second();
  } catch (const std::exception& error) {  // settings, memory or a device: the first flight goes on
    commands.split.reset();
    if (had_second && difference) commands.split.emplace();  // it ends
    if (!difference) message_ = reason_of(error);            // it stays as it was
    if (difference || !had_second) drop(reason_of(error));
    return;
  }
  if (has_budget_) first_.keep_to_budget(kShareOfBudget);
  commands.split = difference_;
  commands.reset = true;
  commands.hold = first_.view().totals.num_steps > 0;  // the start is measured
  drop_flights(commands);
  ++num_begun_;
}

void FlightPair::measure_second() {
  if (has_budget_) second_->keep_to_budget(kShareOfBudget);
  if (has_checkpoints_) second_->keep_checkpoints();
  begin_records();
}

// They are of one scene, as those of the first flight.
void FlightPair::begin_records() {
  Backend& backend = second_->backend();
  const Measures initial = backend.measure();
  record_.emplace(*second_->view().physics, initial, backend.device());
  record_->start_clock();
  figures_ = PairFigures(initial);
}

void FlightPair::drop(const std::string& reason) {
  second_.reset();
  record_.reset();
  difference_.clear();
  message_ = reason;
  if (has_budget_) first_.keep_to_budget();
}

void FlightPair::begin(const Commands& admitted, DrawTarget* first, DrawTarget* second) {
  if (is_new_frame_) second_cut_.reset();
  if (!second_) return first_.begin_frame(admitted, first);
  scenes_before_ = first_.view().num_scenes;
  first_was_past_ = first_.view().history->is_past();
  fallbacks_before_ = first_.num_fallbacks();
  const bool second_leads = is_new_frame_ && !changes_anything(admitted) && ++num_frames_ % 2 == 0;
  if (second_leads) begin_second(admitted, second);
  first_.begin_frame(admitted, first);
  if (first_.num_fallbacks() != fallbacks_before_) return drop("The split view ended with the device.");
  if (!second_leads) begin_second(admitted, second);
}

void FlightPair::begin_second(const Commands& commands, DrawTarget* target) {
  Commands own;
  own.hold = !second_->view().unfinished;
  if (is_new_frame_) own = for_second(commands);
  const bool disturbed =
      commands.settings &&
      differ(second_->settings(), differing(*commands.settings, difference_), &Effects::flight);
  try {
    second_->begin_frame(is_new_frame_ ? second_->admit(own) : own, target);
  } catch (const std::exception& error) {
    return drop(fmt::format("The split view ended: {}", reason_of(error)));
  }
  if (first_.view().num_scenes != scenes_before_) begin_records();
  if (disturbed && !first_.view().physics->ball.exists) figures_.disturb();
  if (in_past() || second_->settings() == differing(first_.settings(), difference_)) return;
  const std::string& why = second_->view().message;
  drop(fmt::format("The split view ended, since its second half cannot follow{}{}", why.empty() ? "" : ": ",
                   why));
}

// A flight that went back flies what it flew before, and changes its settings when it did. The halves' frames
// need not end at the same times; then one of them has a change a frame earlier.
bool FlightPair::in_past() const {
  const auto is_past = [](const FrameView& flight) { return flight.sought_s || flight.history->is_past(); };
  return is_past(first_.view()) || is_past(second_->view());
}

// The commands of the first flight, as the second one executes them. Settings that differ after a flight of
// the past are set again.
Commands FlightPair::for_second(const Commands& commands) const {
  const FrameView& first = first_.view();
  Commands own;
  if (first.num_scenes != scenes_before_) {
    own.restart = differing(first_.settings(), difference_);
    return own;
  }
  if (!commands.split) own = commands;  // else it has just been made
  own.settings.reset();
  const Settings settings = differing(first_.settings(), difference_);
  const bool has_dropped = first_was_past_ && !first.history->is_past();  // the first one its future
  const bool has_new_pace = commands.time_scale_factor != 1.0 && (!in_past() || has_dropped);
  const bool may_edit = commands.settings || has_new_pace || (only_steps(commands) && !in_past());
  const bool follows = may_edit && !(settings == second_->settings());
  if (follows) own.settings = settings;
  if (follows || has_new_pace) own.time_scale_factor = 1.0;  // it is in them
  own.drop_future = has_dropped && (commands.settings || has_new_pace);
  own.scene.clear();
  own.save_scene.clear();
  own.restart.reset();
  own.max_steps = commands.second_max_steps;
  own.hold = (commands.hold && !first_waits_) || second_waits_;
  own.toggle_pause = first.paused != second_->view().paused;
  return own;
}

void FlightPair::finish() {
  first_.finish_frame();
  if (!second_) return;
  if (first_.num_fallbacks() != fallbacks_before_) return drop("The split view ended with the device.");
  try {
    second_->finish_frame();
  } catch (const std::exception& error) {
    return drop(fmt::format("The split view ended: {}", reason_of(error)));
  }
  const FrameView& second = second_->view();
  if (second.times.step_ms() > 0.0)
    record_->add_frame(second.times, second.frame_totals, second.dt_s);
  else
    record_->pass_idle_time();
  if (is_whole()) figures_.follow(first_.view(), first_.backend(), second, second_->backend());
}

FrameView FlightPair::view() const {
  FrameView view = first_.view();
  if (changes_anything(waiting_)) {
    view.waits_for_step = true;
    if (waiting_.settings) view.asked = &*waiting_.settings;
  }
  if (!message_.empty()) {
    view.message = message_;
  } else if (second_ && view.message.empty() && !second_->view().message.empty()) {
    view.message = fmt::format("Second half: {}", second_->view().message);
  }
  return view;
}

nlohmann::json FlightPair::report() {
  if (!second_) return nullptr;
  const FrameView& second = second_->view();
  figures_.complete(first_.view(), first_.backend(), second, second_->backend());
  nlohmann::json flight = record_->finish(second_->settings(), *second.physics, second_->backend(),
                                          second.ball, second.ball_distance_m);
  return {{"set", difference_}, {"second", std::move(flight)}, {"compared", figures_.report()}};
}

}  // namespace pf
