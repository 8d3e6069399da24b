#include "app/domain_checks.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"

namespace pf {
namespace {

// Narrower slabs would mostly hold copies of their neighbours' parcels.
constexpr double kMinSlabWidth = 6.0;  // parcel diameters

void check_slabs(const Physics& physics, unsigned num_domains) {
  if (num_domains == 1 || !physics.parcels.contacts || physics.parcels.num == 0) return;
  const double width_m = size_m(physics.world).x;
  const double min_m = kMinSlabWidth * 2.0 * physics.parcels.radius_m;
  if (width_m / num_domains >= min_m) return;
  const auto max_domains = std::max(1U, static_cast<unsigned>(width_m / min_m));
  throw UserError(fmt::format(
      "--domains: {} slabs of {:.3g} m are narrower than {:g} parcel diameters ({:.3g} m); give at "
      "most {}, or a wider world",
      num_domains, width_m / num_domains, kMinSlabWidth, min_m, max_domains));
}

}  // namespace

void check_backend(const Settings& settings, const Physics& physics, const Backend& backend) {
  if (const std::string refusal = backend.refusal_of(settings.method); !refusal.empty())
    throw UserError(refusal);
  check_slabs(physics, backend.num_domains());
}

}  // namespace pf
