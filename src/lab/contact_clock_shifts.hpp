// Shifts of the study of the contact duration.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace pf {

// Adds to each row its shifts from the row of the same case and restitution without a contact duration, as
// shares, each with a standard error NAME_sigma: `rate` and `energy` of a gas; `path` and `drag` of flights,
// with their mean `collisions` per parcel. A row without that partner gets none.
void conclude_contact_clock(nlohmann::json& result);

}  // namespace pf
