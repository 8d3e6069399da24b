// Terms: the cost of each part of the model in a scene, and the effect of leaving it out on the flight.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/text.hpp"
#include "lab/flight_case.hpp"
#include "lab/parallel_for.hpp"
#include "lab/study.hpp"
#include "lab/terms_verdict.hpp"
#include "scene/derive.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

using nlohmann::json;

struct Variant {
  const char* name;
  const char* term;  // left out or replaced
  void (*change)(Settings&);
};

constexpr Variant kVariants[] = {
    {"all terms", "", [](Settings&) {}},
    {"no contacts", "contacts between parcels", [](Settings& s) { s.contacts = false; }},
    {"no friction", "ball friction", [](Settings& s) { s.friction = 0.0; }},
    {"no Magnus", "Magnus", [](Settings& s) { s.magnus = false; }},
    {"air as drag", "air as parcels: drag instead", [](Settings& s) { s.air = Air::drag; }},
    {"vacuum", "air altogether", [](Settings& s) { s.air = Air::vacuum; }},
};

json fly_variant(const LabDevice& device, Settings s, const Variant& variant, int num_seeds) {
  variant.change(s);
  std::vector<Exit> exits(static_cast<std::size_t>(num_seeds));
  const auto fly = [&](int k, Backend& backend) {
    Settings seeded = s;
    seeded.seed = k + 1;
    exits[static_cast<std::size_t>(k)] = fly_to_exit(seeded, backend);
  };
  // Three flights are timed with the whole machine; the rest run in parallel.
  const int num_timed = std::min(3, num_seeds);
  const std::unique_ptr<Backend> backend = device.make();
  for (int k = 0; k < num_timed; ++k) fly(k, *backend);
  parallel_for(num_seeds - num_timed, 0, [&](int k) { fly(num_timed + k, *make_cpu_backend(1)); });
  json flights = json::array();
  json timed_ms = json::array();
  for (int k = 0; k < num_seeds; ++k) {
    const Exit& exit = exits[static_cast<std::size_t>(k)];
    flights.push_back({exit.at_m.x, exit.at_m.y, exit.speed_mps, exit.time_s, exit.path_m});
    if (k < num_timed) timed_ms.push_back(1e-6 * exit.wall_ns / exit.time_s);
  }
  return {{"variant", variant.name},
          {"term", variant.term},
          {"scene", s.name},
          {"num_parcels", s.num_parcels},
          {"flights", flights},
          {"ms_per_simulated_s", *std::min_element(timed_ms.begin(), timed_ms.end())},
          {"timed_ms_per_simulated_s", timed_ms},
          {"timed_on", backend->device()},
          {"direction", {s.ball_vx_mps, s.ball_vy_mps}}};
}

std::vector<LabPoint> plan_terms(const LabContext& context) {
  if (!is_utf8(context.scene)) {
    throw UserError(
        fmt::format("lab terms: results cannot name scene {}, which is not UTF-8; rename the file",
                    in_quotes(context.scene)));
  }
  Settings scene = load_scene(context.scene);
  if (!scene.ball_present || scene.ball_held || scene.boundary != Boundary::open ||
      scene.air != Air::parcels) {
    throw UserError(
        fmt::format("lab terms: scene {} has no ball that flies through parcels and leaves an open world; "
                    "give another with --scene, such as court or regulation",
                    context.scene));
  }
  // Where parcels have a radius or a mass of their own, their number makes the air what it is.
  const bool keeps_number = radius_sets_density(scene) || scene.parcel_mass_kg > 0.0;
  scene.num_parcels = keeps_number ? resolve_num_parcels(scene, "cpu") : (context.quick ? 4000 : 20000);
  std::vector<LabPoint> points;
  const LabDevice& device = context.devices.front();
  const int num_seeds = context.quick ? 8 : 32;
  for (const Variant& variant : kVariants) {
    Settings without = scene;
    variant.change(without);
    const bool has_all = &variant == &kVariants[0];
    if (!has_all && without == scene) continue;  // the scene has no such term
    points.push_back(
        {fmt::format("{}/{}", context.scene, variant.name),
         [device, scene, &variant, num_seeds] { return fly_variant(device, scene, variant, num_seeds); }});
  }
  return points;
}

}  // namespace

Study terms_study() {
  return {"terms", "Cost and effect of each term of the model",
          "Left: the shift of the ball's exit and of its speed there without the term, against the dashed "
          "tolerance; right: the cost of the term. A term whose two bars end left of the dashed line may be "
          "left out.",
          plan_terms, conclude_terms};
}

}  // namespace pf
