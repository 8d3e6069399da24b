// Parcel-parcel contacts of the time-stepped methods: narrow phase and response in double precision. Sums are
// 64-bit fixed point, so that the order of a parcel's partners does not matter.
#pragma once

#include <cstdint>

#include "model/parcel.hpp"
#include "model/tally.hpp"

namespace pf {

constexpr double kPushOutUnit = 65536.0;  // counts of a push-out sum per position unit

// A pair's impulse over parcel mass, as counts of the tallied sum. One contact adds at most 2^25 counts.
PF_HD inline std::int32_t impulse_counts(const StepConstants& c, double impulse_mps) {
  constexpr double kMax = 33554432.0;
  const double counts = impulse_mps * c.per_impulse_count;
  return static_cast<std::int32_t>(round_to_int64(counts > kMax ? kMax : (counts < -kMax ? -kMax : counts)));
}

// Sums of a parcel's contacts in one step.
struct ContactSums {
  std::int64_t velocity_x = 0;  // counts of velocity_unit_mps
  std::int64_t velocity_y = 0;
  std::int64_t push_x = 0;  // counts of 1 / kPushOutUnit position units
  std::int64_t push_y = 0;

  PF_HD ContactSums& operator+=(const ContactSums& o) {
    velocity_x += o.velocity_x;
    velocity_y += o.velocity_y;
    push_x += o.push_x;
    push_y += o.push_y;
    return *this;
  }
};

// What a contact adds for the other parcel of the pair. The smallest integer, which stands for a change that
// is not finite, is its own opposite.
PF_HD inline ContactSums operator-(const ContactSums& sums) {
  const auto opposite = [](std::int64_t sum) {
    return static_cast<std::int64_t>(0U - static_cast<std::uint64_t>(sum));
  };
  return {opposite(sums.velocity_x), opposite(sums.velocity_y), opposite(sums.push_x), opposite(sums.push_y)};
}

// Geometry of a touching pair, seen from self. Coincident centres get the normal (1, 0), from the lower id to
// the higher one.
struct PairGeometry {
  Vec2d offset;      // other - self, position units
  double distance2;  // position units squared
  double distance;
  Vec2d normal;  // from self to other
};

PF_HD inline PairGeometry pair_geometry(Vec2i offset, std::uint32_t self_id, std::uint32_t other_id) {
  const Vec2d e = to_double(offset);
  const double distance2 = dot(e, e);
  const double distance = sqrt(distance2);
  if (distance2 == 0.0) return {e, 0.0, 0.0, {self_id < other_id ? 1.0 : -1.0, 0.0}};
  return {e, distance2, distance, {e.x / distance, e.y / distance}};
}

PF_HD inline void add_velocity(const StepConstants& c, Vec2d change_mps, ContactSums& sums) {
  sums.velocity_x += round_to_int64(change_mps.x * c.per_velocity_unit);
  sums.velocity_y += round_to_int64(change_mps.y * c.per_velocity_unit);
}

// Pushes each parcel of an overlapping pair away by half the overlap. Method `exact` applies it alone to a
// state that another method left.
struct PushOutContact {
  template <EventTally Tally>
  PF_HD static void respond(const StepConstants& c, const Parcel& self, const Parcel& other,
                            const PairGeometry& pair, ContactSums& sums, Tally& tally) {
    const double overlap = c.contact_distance - pair.distance;
    const double push = -0.5 * overlap * kPushOutUnit;
    sums.push_x += round_to_int64(push * pair.normal.x);
    sums.push_y += round_to_int64(push * pair.normal.y);
    if (self.id < other.id) tally.overlap(static_cast<float>(overlap / c.contact_distance));
  }
};

// The seed's method with corrected signs, as a Jacobi step: every contact reads the state before the step.
// Overlapping pairs are pushed apart. Approaching pairs exchange the impulse that makes v_rel,n' = -e v_rel,n
// at impulse_scale 1.
struct ImpulseContact {
  template <EventTally Tally>
  PF_HD static void respond(const StepConstants& c, const Parcel& self, const Parcel& other,
                            const PairGeometry& pair, ContactSums& sums, Tally& tally) {
    PushOutContact::respond(c, self, other, pair, sums, tally);
    const Vec2d relative = to_double(other.velocity) - to_double(self.velocity);
    const double approach = dot(relative, pair.normal);
    if (!(approach < 0.0)) return;
    const ParcelConstants& parcels = c.physics.parcels;
    const double change = 0.5 * (1.0 + parcels.restitution) * parcels.impulse_scale * approach;
    add_velocity(c, pair.normal * change, sums);
    if (self.id < other.id) {
      tally.begin_contact();
      tally.impulse(impulse_counts(c, -change));
    }
  }
};

// Linear spring-dashpot: a force along the normal while the pair overlaps (discrete element method, Cundall
// and Strack 1979). Semi-implicit: the velocity changes first, and the position moves with the new velocity.
// A contact is counted in the step in which the overlap begins.
struct SpringContact {
  template <EventTally Tally>
  PF_HD static void respond(const StepConstants& c, const Parcel& self, const Parcel& other,
                            const PairGeometry& pair, ContactSums& sums, Tally& tally) {
    const double unit_m = c.physics.world.unit_m;
    const double overlap = c.contact_distance - pair.distance;
    const Vec2d relative = to_double(other.velocity) - to_double(self.velocity);
    const double approach = dot(relative, pair.normal);
    const double repulsion_mps =
        (c.spring_rate_per_s2 * overlap * unit_m - c.damping_rate_per_s * approach) * c.dt_s;
    add_velocity(c, pair.normal * -repulsion_mps, sums);
    if (self.id < other.id) {
      tally.overlap(static_cast<float>(overlap / c.contact_distance));
      tally.impulse(impulse_counts(c, repulsion_mps * pair.distance / c.contact_distance));
      const Vec2d before = pair.offset * unit_m - relative * c.dt_s;
      const double contact_m = c.contact_distance * unit_m;
      if (dot(before, before) >= contact_m * contact_m) tally.begin_contact();
    }
  }
};

// Adds the contact to self's sums if the pair touches. offset: other - self, nearest image.
template <class Contact, EventTally Tally>
PF_HD inline void add_contact(const StepConstants& c, const Parcel& self, const Parcel& other, Vec2i offset,
                              ContactSums& sums, Tally& tally) {
  const PairGeometry pair = pair_geometry(offset, self.id, other.id);
  if (pair.distance2 >= c.contact_distance2 || is_retired(other.position)) return;
  Contact::respond(c, self, other, pair, sums, tally);
}

}  // namespace pf
