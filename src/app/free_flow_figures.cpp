#include "app/free_flow_figures.hpp"

#include <cmath>

#include "model/free_flow.hpp"

namespace pf {

bool is_free_flow(const FrameView& view) {
  const Settings& settings = *view.settings;
  const BallConstants& ball = view.physics->ball;
  return ball.exists && ball.held && ball.friction == 0.0 && settings.air == Air::parcels &&
         !view.physics->parcels.contacts && view.physics->world.boundary == Boundary::periodic &&
         settings.parcel_speed_mps > 0.0 && settings.hot_radius_m == 0.0 &&
         std::hypot(settings.flow_x_mps, settings.flow_y_mps) > 0.0;
}

std::optional<FreeFlowFigures> free_flow_figures(const FrameView& view, const StepTotals& since,
                                                 double since_s) {
  const auto num_hits = static_cast<double>(view.totals.num_ball_hits - since.num_ball_hits);
  const double time_s = view.simulated_s - since_s;
  if (!is_free_flow(view) || num_hits <= 0.0 || time_s <= 0.0) return std::nullopt;
  const ParcelConstants& parcels = view.physics->parcels;
  const Vec2d flow = {view.settings->flow_x_mps, view.settings->flow_y_mps};
  const double speed_mps = length(flow), contact_m = view.physics->ball.radius_m + parcels.radius_m;
  const double speed_ratio = speed_mps / (std::sqrt(2.0) * view.settings->parcel_speed_mps);
  const double num_per_m2 = parcels.num / area_m2(view.physics->world);
  const double hits_per_s = 2.0 * contact_m * num_per_m2 * speed_mps * free_flow_hits(speed_ratio);
  const double force_n = smooth_drag(speed_ratio, parcels.restitution) * num_per_m2 * parcels.mass_kg *
                         speed_mps * speed_mps * contact_m;
  const Vec2d impulse = view.totals.ball_impulse_kg_mps - since.ball_impulse_kg_mps;
  const double hits = num_hits / (hits_per_s * time_s);
  const double drag = dot(impulse, flow) / (speed_mps * force_n * time_s);
  return FreeFlowFigures{drag, drag * smooth_drag_error(speed_ratio, num_hits), hits,
                         hits / std::sqrt(num_hits)};
}

}  // namespace pf
