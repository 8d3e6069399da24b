#include "app/step_request.hpp"

#include "scene/derive.hpp"

namespace pf {

StepRequest step_request(const Settings& settings, const Physics& physics, std::uint32_t num_steps,
                         double dt_s) {
  StepRequest request;
  request.method = settings.method;
  request.neighbors = settings.neighbors;
  request.num_steps = num_steps;
  request.dt_s = dt_s;
  request.spring_contact_s = spring_contact_s(settings, dt_s);
  request.contact_clock_s = contact_clock_s(settings, physics);
  return request;
}

}  // namespace pf
