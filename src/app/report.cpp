#include "app/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/json_number.hpp"
#include "core/error.hpp"
#include "core/replace_file.hpp"
#include "core/statistics.hpp"
#include "core/text.hpp"
#include "model/kinetic_theory.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxFrames = 1U << 20U;  // kept, some 150 bytes each

// null where the ratio has no meaning.
json ratio(double numerator, double denominator) {
  return denominator > 0.0 ? number_or_null(numerator / denominator) : json(nullptr);
}

json vector(Vec2d value) { return json::array({number_or_null(value.x), number_or_null(value.y)}); }

// null without values.
json statistics_of(std::vector<double> values) {
  if (values.empty()) return {{"median", nullptr}, {"p99", nullptr}};
  const auto [median, p99] = median_and_p99(values);
  return {{"median", number_or_null(median)}, {"p99", number_or_null(p99)}};
}

json phase_report(const std::vector<RecordedFrame>& frames) {
  json report = json::object();
  for (std::size_t phase = 0; phase < kNumPhases; ++phase) {
    std::vector<double> values;
    values.reserve(frames.size());
    for (const RecordedFrame& frame : frames) values.push_back(frame.times.ms[phase]);
    report[kPhaseNames[phase]] = statistics_of(std::move(values));
  }
  return report;
}

// Statistics over the frames whose value is known, that is not NaN.
template <class Value>
json known_statistics(const std::vector<RecordedFrame>& frames, const Value& value_of) {
  std::vector<double> values;
  for (const RecordedFrame& frame : frames) {
    if (const double value = value_of(frame); std::isfinite(value)) values.push_back(value);
  }
  return statistics_of(std::move(values));
}

json known_statistics(const std::vector<RecordedFrame>& frames, double DrawTimes::*member) {
  return known_statistics(frames, [member](const RecordedFrame& frame) { return frame.drawing.*member; });
}

double render_ms(const PhaseTimes& times) {
  return times[Phase::map] + times[Phase::unmap] + times[Phase::draw] + times[Phase::present];
}

json energy_report(const Measures& initial, const Measures& final) {
  return {{"initial_j", number_or_null(initial.energy_j())},
          {"final_j", number_or_null(final.energy_j())},
          {"relative_drift", ratio(final.energy_j() - initial.energy_j(), initial.energy_j())}};
}

json momentum_report(const Measures& initial, const Measures& final) {
  const Vec2d change = final.momentum_kg_mps - initial.momentum_kg_mps;
  return {{"initial", vector(initial.momentum_kg_mps)},
          {"final", vector(final.momentum_kg_mps)},
          {"relative_drift", ratio(length(change), initial.momentum_scale_kg_mps)}};
}

json collision_report(const Physics& physics, const StepTotals& totals, double simulated_s,
                      double speed_mps) {
  const ParcelConstants& parcels = physics.parcels;
  const bool can_collide = parcels.num > 1 && parcels.contacts;
  json report = {{"count", totals.num_collisions},
                 {"rate_per_parcel_per_s", nullptr},
                 {"enskog_rate_per_parcel_per_s", nullptr}};
  if (!can_collide) return report;
  const double collisions = 2.0 * static_cast<double>(totals.num_collisions);  // one counts for both partners
  report["rate_per_parcel_per_s"] = ratio(collisions, parcels.num * simulated_s);
  report["enskog_rate_per_parcel_per_s"] =
      number_or_null(enskog_rate_per_s(area_fraction_of(physics), speed_mps, parcels.radius_m));
  return report;
}

json compressibility(const ParcelConstants& parcels, const StepTotals& totals, double simulated_s,
                     double speed_mps) {
  if (totals.num_collisions == 0 || parcels.num == 0) return nullptr;
  return number_or_null(measured_compressibility(totals.impulse_sum_mps, simulated_s, parcels.num,
                                                 speed_mps * speed_mps, 2.0 * parcels.radius_m));
}

json ball_report(const BallConstants& constants, const BallState& ball, const StepTotals& totals,
                 double distance_m) {
  if (!constants.exists) return nullptr;
  return {{"x_m", number_or_null(ball.position_m.x)},
          {"y_m", number_or_null(ball.position_m.y)},
          {"vx_mps", number_or_null(ball.velocity_mps.x)},
          {"vy_mps", number_or_null(ball.velocity_mps.y)},
          {"spin_radps", number_or_null(ball.spin_radps)},
          {"distance_m", number_or_null(distance_m)},
          {"hits", totals.num_ball_hits},
          {"impulse_x_kg_mps", number_or_null(totals.ball_impulse_kg_mps.x)},
          {"impulse_y_kg_mps", number_or_null(totals.ball_impulse_kg_mps.y)},
          {"torque_impulse_kg_m2ps", number_or_null(totals.ball_torque_impulse_kg_m2ps)}};
}

// null for time-stepped methods.
json exact_report(const Settings& settings, const Physics& physics, const StepTotals& totals) {
  if (settings.method != Method::exact) return nullptr;
  const double units_per_diameter = 2.0 * physics.parcels.radius_m / physics.world.unit_m;
  return {{"max_overlap_units", number_or_null(totals.max_overlap_diameters * units_per_diameter)},
          {"rounds", totals.num_rounds},
          {"retried_steps", totals.num_retried_steps},
          {"events", totals.num_events},
          {"solved_events", totals.num_solved_events},
          {"largest_cluster", totals.largest_cluster},
          {"event_hash", fmt::format("{:016x}", totals.event_hash)}};
}

}  // namespace

// The settings are not kept: finish() takes those at the end.
RunRecord::RunRecord(const Physics& physics, const Measures& initial, std::string device)
    : initial_(initial),
      device_(std::move(device)),
      speed_mps_(thermal_speed_mps(physics.parcels, initial)),
      start_(Clock::now()),
      timed_from_(start_),
      last_frame_(start_) {}

void RunRecord::add_frame(const PhaseTimes& times, const StepTotals& totals, double dt_s,
                          const DrawTimes& drawing) {
  const Clock::time_point now = Clock::now();
  const double interval_ms = std::chrono::duration<double, std::milli>(now - last_frame_).count();
  last_frame_ = now;
  if (num_frames_ % stride_ == 0)
    frames_.push_back({times, drawing, num_frames_ == 0 ? DrawTimes::kUnknown : interval_ms});
  ++num_frames_;
  if (frames_.size() > kMaxFrames) thin_out();
  compute_ms_ += times.step_ms();
  if (num_frames_ > num_warmup_) sum_ += times;
  if (num_frames_ == num_warmup_) timed_from_ = last_frame_;
  totals_ += totals;
  simulated_s_ += static_cast<double>(totals.num_steps) * dt_s;
  dt_s_ = dt_s;
}

void RunRecord::pass_idle_time() {
  const Clock::time_point now = Clock::now();
  timed_from_ += now - last_frame_;
  last_frame_ = now;
}

// Keeps every other frame.
void RunRecord::thin_out() {
  for (std::size_t k = 0; 2 * k < frames_.size(); ++k) frames_[k] = frames_[2 * k];
  frames_.resize((frames_.size() + 1) / 2);
  stride_ *= 2;
}

void RunRecord::continue_from(const StepTotals& totals, double simulated_s) {
  earlier_ = totals;
  simulated_s_ = simulated_s;
}

void RunRecord::set_part(const std::string& key, const json& part) {
  parts_.emplace_back(key, part.dump(-1, ' ', false, json::error_handler_t::replace));
}

void RunRecord::start_clock() { start_ = timed_from_ = last_frame_ = Clock::now(); }

json RunRecord::frame_report() const {
  json report = {{"num", 0},
                 {"warmup", num_warmup_},
                 {"frame_ms", nullptr},
                 {"physics_ms", nullptr},
                 {"render_ms", nullptr},
                 {"overhead_ms", nullptr}};
  if (num_frames_ <= num_warmup_) return report;
  const double num = static_cast<double>(num_frames_ - num_warmup_);
  const double frame_ms = std::chrono::duration<double, std::milli>(last_frame_ - timed_from_).count() / num;
  report["num"] = num_frames_ - num_warmup_;
  report["frame_ms"] = number_or_null(frame_ms);
  report["physics_ms"] = number_or_null(sum_.step_ms() / num);
  report["render_ms"] = number_or_null(render_ms(sum_) / num);
  report["overhead_ms"] = number_or_null(std::max(0.0, frame_ms - (sum_.step_ms() + render_ms(sum_)) / num));
  return report;
}

json RunRecord::finish(const Settings& settings, const Physics& physics, Backend& backend,
                       const BallState& ball, double ball_distance_m) const {
  const double wall_s = 1e-3 * milliseconds_since(start_);
  const Measures final = backend.measure();
  const ParcelConstants& parcels = physics.parcels;
  const bool has_parcels = parcels.num > 0;
  StepTotals all = earlier_;
  all += totals_;
  const double final_speed_mps = thermal_speed_mps(physics.parcels, final);
  // The thermal speed that belongs to the mean of the initial and the final energy.
  const double speed_mps = std::sqrt(0.5 * (speed_mps_ * speed_mps_ + final_speed_mps * final_speed_mps));
  const double compute_s = 1e-3 * compute_ms_;
  const double parcel_steps = static_cast<double>(parcels.num) * static_cast<double>(totals_.num_steps);
  json report = {
      {"version", PF_VERSION},
      {"device", device_},
      {"domain_link", backend.domain_link().empty() ? json(nullptr) : json(backend.domain_link())},
      {"scene", settings.name},
      {"method", value_text("run.method", settings)},
      {"neighbors", value_text("run.neighbors", settings)},
      {"num_parcels", parcels.num},
      {"area_fraction", has_parcels ? number_or_null(area_fraction_of(physics)) : json(nullptr)},
      {"restitution", number_or_null(parcels.restitution)},
      {"dt_s", number_or_null(dt_s_)},
      {"steps", all.num_steps},
      {"simulated_s", number_or_null(simulated_s_)},
      {"wall_s", number_or_null(wall_s)},
      {"frame_ms", known_statistics(frames_, [](const RecordedFrame& frame) { return frame.interval_ms; })},
      {"phase_ms", phase_report(frames_)},
      {"host_ms",
       {{"draw", known_statistics(frames_, &DrawTimes::host_draw_ms)},
        {"panel", known_statistics(frames_, &DrawTimes::host_panel_ms)}}},
      {"gpu_ms",
       {{"draw", known_statistics(frames_, &DrawTimes::gpu_draw_ms)},
        {"panel", known_statistics(frames_, &DrawTimes::gpu_panel_ms)}}},
      {"ns_per_parcel_step", ratio(1e9 * compute_s, parcel_steps)},
      {"parcel_steps_per_s", has_parcels ? ratio(parcel_steps, compute_s) : json(nullptr)},
      {"energy", energy_report(initial_, final)},
      {"momentum", momentum_report(initial_, final)},
      {"collisions", collision_report(physics, all, simulated_s_, speed_mps)},
      {"compressibility", compressibility(parcels, all, simulated_s_, speed_mps)},
      {"max_overlap_diameters",
       all.num_collisions > 0 ? number_or_null(all.max_overlap_diameters) : json(nullptr)},
      {"num_retired", all.num_retired},
      {"exact", exact_report(settings, physics, all)},
      {"ball", ball_report(physics.ball, ball, all, ball_distance_m)},
      {"state_hash", fmt::format("{:016x}", backend.state_hash())},
      {"memory_bytes", backend.memory_bytes()},
  };
  for (const auto& [key, text] : parts_) report[key] = json::parse(text);
  return report;
}

void write_report(const std::filesystem::path& file, const json& report) {
  // A file name that is not UTF-8 must not prevent the report.
  const std::string problem =
      replace_file(file, report.dump(2, ' ', false, json::error_handler_t::replace) + '\n');
  if (problem.empty()) return;
  throw OutputError(fmt::format(
      "{}: the report cannot be written ({}); choose a folder that exists, is writable and has room",
      in_quotes(file.string()), problem));
}

}  // namespace pf
