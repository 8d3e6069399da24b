// The steps of a frame, in one picture or, with a budget, in several.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/command_queue.hpp"
#include "app/simulation_state.hpp"
#include "app/step_request.hpp"
#include "model/methods.hpp"
#include "scene/derive.hpp"
#include "scene/scene_file.hpp"

namespace pf {

Commands Simulation::State::admit(const Commands& wanted) {
  const bool is_first_edit = wanted.settings && !waiting.settings;
  waiting = joined(waiting, wanted);
  if (sought) {
    if (is_first_edit) waiting.settings = at_target(*wanted.settings);
    return admit_while_seeking();
  }
  if (frame) {
    const bool must_complete = frame->mid_step || history.next_frame() != nullptr;
    const bool is_in_step = must_complete && !(starts_anew(waiting) && can_start_anew());
    if (only_steps(waiting) || is_in_step) return {};
    end_frame();
  }
  return std::exchange(waiting, {});
}

// Returns whether the waiting commands can start, as far as that is known without starting them.
bool Simulation::State::can_start_anew() const {
  try {
    Settings with = waiting.settings.value_or(settings);
    if (!waiting.scene.empty()) with = load_scene(waiting.scene);
    if (waiting.restart) with = *waiting.restart;
    resolve(with);
    new_air(with, initial_ball(with));
    return true;
  } catch (const UserError&) {
    return false;
  }
}

// A frame that was flown already gets the same settings and steps.
void Simulation::State::begin_steps(const Commands& commands) {
  repeat_changes();
  keep_checkpoint_when_due();
  energy_watch.begin_frame(view, *backend);
  frame.emplace();
  frame->plan = plan_frame(settings, physics, ball, collision_rate_per_s);
  frame->num_steps = std::min(frame->plan.num_steps, commands.max_steps.value_or(UINT32_MAX));
  if (const FlownFrame* known = history.next_frame())
    frame->num_steps = std::min(frame->num_steps, known->num_steps);
  frame->start_s = view.simulated_s;
}

// The figures of the next frame, while there is none in hand.
void Simulation::State::show_plan() {
  const FramePlan plan = plan_frame(settings, physics, ball, collision_rate_per_s);
  view.num_pictures = num_frame_pictures;
  view.dt_s = plan.dt_s;
  view.steps_per_frame = plan.num_steps;
  view.slow_motion = plan.slow_motion / view.num_pictures;
}

// A step that input waits for is completed first. Backends may ignore the budget between steps, so that the
// number of steps keeps to it, too. A series of `exact` is not divided here.
std::uint32_t Simulation::State::num_steps_to_submit() const {
  const std::uint32_t left = frame->num_steps - frame->num_done;
  if (!only_steps(waiting)) return 1;
  const double budget_ms = budget_share * settings.frame_budget_ms;
  if (budget_ms <= 0.0 || step_ms <= 0.0 || settings.method == Method::exact) return left;
  return static_cast<std::uint32_t>(std::clamp<double>(budget_ms / step_ms, 1.0, left));
}

void Simulation::State::submit_steps(DrawTarget* target) {
  if (frame->num_done == frame->num_steps) {
    if (target) draw_again(*target);
    return;
  }
  StepRequest request = step_request(settings, physics, num_steps_to_submit(), frame->plan.dt_s);
  request.num_done = frame->num_done;
  request.budget_ms = budget_share * settings.frame_budget_ms;
  DrawBuffers buffers;
  if (target) {
    target->reserve(physics.parcels.num);
    ScopedPhase timing(mapping, Phase::map);
    buffers = target->map();
    request.draw = &buffers;
  }
  try {
    backend->submit(request);
  } catch (...) {
    if (target) target->unmap();
    throw;
  }
  in_flight = true;
  if (target) {
    ScopedPhase timing(mapping, Phase::unmap);
    target->unmap();
  }
}

void Simulation::State::collect_steps() { take_over(backend->collect()); }

// Adds the steps that a request has done to those of the frame.
void Simulation::State::take_over(const StepReport& report) {
  in_flight = false;
  const auto num_steps = static_cast<std::uint32_t>(report.totals.num_steps);
  frame->num_done += num_steps;
  frame->mid_step = report.mid_step;
  frame->totals += report.totals;
  ++frame->num_pictures;
  if (num_steps > 0) step_ms = report.times.step_ms() / num_steps;
  ball = report.ball;
  const FramePlan& plan = frame->plan;
  view.num_done = frame->num_done;
  view.mid_step = frame->mid_step;
  view.num_pictures = std::max(frame->num_pictures, num_frame_pictures);
  view.dt_s = plan.dt_s;
  view.steps_per_frame = plan.num_steps;
  view.slow_motion = plan.slow_motion / view.num_pictures;
  view.times = report.times;
  view.times += mapping;
  view.frame_totals = report.totals;
  view.min_bytes_moved = backend->min_bytes_moved(report.totals);
  view.totals += report.totals;
  view.simulated_s = frame->start_s + frame->num_done * plan.dt_s;
  flight.compute_ms += report.times.total();
  if (frame->num_done == frame->num_steps) end_frame();
}

// After all steps of a frame, or fewer if commands ended it. A replay of the same number of steps does the
// same: what a dropped step added to the totals has no effect.
void Simulation::State::end_frame() {
  const FrameSteps ended = *frame;
  frame.reset();
  const FramePlan& plan = ended.plan;
  view.num_done = ended.num_done;
  if (ended.num_done == plan.num_steps) {
    collision_rate_per_s = measured_rate_per_s(ended.totals.num_collisions, physics.parcels.num, plan);
    num_frame_pictures = ended.num_pictures;
  }
  profile_is_due = true;
  pause_if_invalid(ended.totals);
  pause_if_blown_up();
  shown_s += 1.0 / settings.frame_rate_hz;
  history.pass_frame({view.simulated_s - launched_at_s, ended.num_done, ended.totals.num_ball_hits});
  flight.dt_s = plan.dt_s;
  flight.num_steps += ended.num_done;
  follow_ball();
  view.ball = ball;
  free_flow.follow(view, ended.totals, ended.num_done * plan.dt_s);
  if (view.flight == Flight::flying && has_left(physics, ball)) {
    view.flight = Flight::landed;
    left_once = true;
    flight.has_left = true;
    history.end();
    end_flight();
    repeat_changes();  // those made after the flight had ended
  }
}

void Simulation::State::pause_if_invalid(const StepTotals& totals) {
  if (totals.num_invalid == 0) return;
  view.paused = true;
  const std::string when = settings.method == Method::exact  // which does not divide time into steps
                               ? ""
                               : fmt::format(" in step {}", totals.first_invalid_step);
  view.message = fmt::format(
      "Paused: {} parcel{} left the range of numbers{}, the first with id {}. Shorten the step (run.dt_s, "
      "run.displacement_per_step) or slow the ball, then reset.",
      totals.num_invalid, totals.num_invalid == 1 ? "" : "s", when, totals.first_invalid_id);
}

void Simulation::State::pause_if_blown_up() {
  const double growth = energy_watch.end_frame(view, *backend);
  if (growth == 0.0) return;
  view.paused = true;
  view.message = fmt::format(
      "Paused: the energy has grown {:.0f}-fold, which only the steps of method {} do here. Take method "
      "exact, a shorter run.dt_s, air.impulse_scale = 1 or a lower air.area_fraction, then reset.",
      growth, method_name(settings.method));
}

// Draws the current state without a step.
void Simulation::State::draw_again(DrawTarget& target) {
  target.reserve(physics.parcels.num);
  const DrawBuffers buffers = target.map();
  try {
    backend->draw(buffers);
  } catch (...) {
    target.unmap();
    throw;
  }
  target.unmap();
}

}  // namespace pf
