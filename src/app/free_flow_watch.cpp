#include "app/free_flow_watch.hpp"

#include <algorithm>
#include <cmath>

#include "app/simulation.hpp"
#include "model/free_flow.hpp"

namespace pf {

std::optional<FreeFlow> free_flow_of(const FrameView& view) {
  const Settings& settings = *view.settings;
  const World& world = view.physics->world;
  const ParcelConstants& parcels = view.physics->parcels;
  const BallConstants& ball = view.physics->ball;
  const double thermal_mps = settings.parcel_speed_mps;
  FreeFlow flow{.flow_mps = {settings.flow_x_mps, settings.flow_y_mps}};
  const double speed_mps = length(flow.flow_mps);
  const bool is_known = ball.exists && ball.held && ball.friction == 0.0 && settings.air == Air::parcels &&
                        !parcels.contacts && world.boundary == Boundary::periodic && thermal_mps > 0.0 &&
                        speed_mps > 0.0 && settings.hot_radius_m == 0.0;
  if (!is_known) return std::nullopt;
  const double contact_m = ball.radius_m + parcels.radius_m;
  const double num_per_m2 = parcels.num / (area_m2(world) - kPi * contact_m * contact_m);
  flow.speed_ratio = speed_mps / (std::sqrt(2.0) * thermal_mps);
  flow.hits_per_s = free_flow_hits_per_s(contact_m, num_per_m2, speed_mps, flow.speed_ratio);
  flow.drag_n = drag_force_n(smooth_drag(flow.speed_ratio, parcels.restitution), num_per_m2 * parcels.mass_kg,
                             speed_mps, contact_m);
  constexpr double kFastest = 4.5;  // thermal speeds: one parcel in 25,000 has more in two dimensions
  const Vec2d size = size_m(world);
  flow.lasts_s = (std::min(size.x, size.y) - 2.0 * contact_m) / (speed_mps + kFastest * thermal_mps);
  return flow;
}

void FreeFlowWatch::spawned() {
  forget();
  is_fresh_ = true;
}

void FreeFlowWatch::forget() {
  is_fresh_ = false;
  start_.reset();
  figures_.reset();
}

void FreeFlowWatch::follow(const FrameView& view, const StepTotals& frame, double frame_s) {
  const std::optional<FreeFlow> flow = free_flow_of(view);
  if (is_fresh_ && flow) {
    start_ = {*flow, view.totals.num_ball_hits - frame.num_ball_hits,
              view.totals.ball_impulse_kg_mps - frame.ball_impulse_kg_mps, view.simulated_s - frame_s};
  }
  is_fresh_ = false;
  if (!start_ || !flow || start_->flow != *flow) return forget();
  const double time_s = view.simulated_s - start_->simulated_s;
  if (time_s > flow->lasts_s || time_s <= 0.0) return;
  const auto num_hits = static_cast<double>(view.totals.num_ball_hits - start_->num_hits);
  if (num_hits == 0.0) return figures_.reset();
  const double speed_mps = length(flow->flow_mps);
  const Vec2d impulse = view.totals.ball_impulse_kg_mps - start_->impulse_kg_mps;
  const double hits = num_hits / (flow->hits_per_s * time_s);
  figures_ = {.drag_over_theory = dot(impulse, flow->flow_mps) / (speed_mps * flow->drag_n * time_s),
              .drag_error = hits * smooth_drag_error(flow->speed_ratio, num_hits),
              .hits_over_theory = hits,
              .hits_error = hits / std::sqrt(num_hits)};
}

}  // namespace pf
