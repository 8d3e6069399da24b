#include "lab/flow_layer.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "lab/mean_error.hpp"
#include "lab/parallel_for.hpp"

namespace pf {

using nlohmann::json;

json measure_layer(const DragCase& layer, const FlowSteps& steps, int num_seeds, const LabDevice& device) {
  constexpr int kNumTimed = 8;
  const bool is_cpu = device.name == "cpu";
  const int num_timed = is_cpu ? std::min(kNumTimed, num_seeds) : num_seeds;
  std::vector<double> drag(static_cast<std::size_t>(num_seeds));
  double min_ns = INFINITY;
  const auto run = [&](int k, Backend& backend) {
    DragCase seeded = layer;
    seeded.seed = k + 1;
    const json row = measure_drag(seeded, steps, backend);
    drag[static_cast<std::size_t>(k)] = row.at("drag").get<double>();
    return row.at("ns_per_disc_time").get<double>();
  };
  const std::unique_ptr<Backend> backend = is_cpu ? make_cpu_backend(1) : device.make();
  for (int k = 0; k < num_timed; ++k) min_ns = std::min(min_ns, run(k, *backend));
  parallel_for(num_seeds - num_timed, 0, [&](int k) { run(num_timed + k, *make_cpu_backend(1)); });
  const MeanError mean = mean_and_error(drag);
  return {{"drag", mean.mean},
          {"drag_sigma", mean.sigma},
          {"num_seeds", num_seeds},
          {"ns_per_disc_time", min_ns}};
}

}  // namespace pf
