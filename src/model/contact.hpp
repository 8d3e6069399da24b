// Parcel-parcel contacts of the time-stepped methods. Whether a pair touches is decided in integers. The
// response is computed in float, which is finer than these methods are, from offsets and overlaps that are
// differences of integers. Sums are 64-bit fixed point, so that the order of a parcel's partners does not
// matter.
#pragma once

#include <cstdint>

#include "core/fixed_point.hpp"
#include "model/parcel.hpp"
#include "model/tally.hpp"

namespace pf {

constexpr int kPushBits = 16;  // of a fraction of a position unit, in sums of push-outs
constexpr double kPushOutUnit = double{1 << kPushBits};  // counts of a push-out sum per position unit

// A pair's impulse over parcel mass, as counts of the tallied sum. One contact adds at most 2^25 counts.
// per_mps: counts per m/s.
template <class Real>
PF_HD inline std::int32_t impulse_counts(Real impulse_mps, Real per_mps) {
  constexpr Real kMax = 33554432;
  const Real counts = impulse_mps * per_mps;
  return round_to_int32(counts > kMax ? kMax : (counts < -kMax ? -kMax : counts));
}

// Sums of a parcel's contacts in one step.
struct ContactSums {
  std::int64_t velocity_x = 0;  // counts of velocity_unit_mps
  std::int64_t velocity_y = 0;
  std::int64_t push_x = 0;  // counts of 1 / kPushOutUnit position units
  std::int64_t push_y = 0;
  std::uint8_t num_contacts = 0;  // of `impulse`, modulo 2^8

  PF_HD ContactSums& operator+=(const ContactSums& o) {
    add_velocity(o.velocity_x, o.velocity_y);
    add_push(o.push_x, o.push_y);
    num_contacts = static_cast<std::uint8_t>(num_contacts + o.num_contacts);
    return *this;
  }
  PF_HD void add_velocity(std::int64_t x, std::int64_t y) {
    velocity_x = sum_of(velocity_x, x);
    velocity_y = sum_of(velocity_y, y);
  }
  PF_HD void add_push(std::int64_t x, std::int64_t y) {
    push_x = sum_of(push_x, x);
    push_y = sum_of(push_y, y);
  }

 private:
  // Modulo 2^64, as the GPU's atomics: what stands for a change that is not finite may be among them.
  PF_HD static std::int64_t sum_of(std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
  }
};

// Sums of the same contact for the other parcel of the pair. The smallest integer, which stands for a change
// out of range, is its own opposite.
PF_HD inline ContactSums operator-(const ContactSums& sums) {
  const auto opposite = [](std::int64_t sum) {
    return static_cast<std::int64_t>(0U - static_cast<std::uint64_t>(sum));
  };
  return {opposite(sums.velocity_x), opposite(sums.velocity_y), opposite(sums.push_x), opposite(sums.push_y),
          sums.num_contacts};
}

// Geometry of a touching pair, seen from self, in position units. Coincident centres get the normal (1, 0),
// from the lower id to the higher one.
struct PairGeometry {
  Vec2f offset;  // other - self
  float gap2;    // contact distance squared minus distance squared
  float distance;
  float overlap;
  Vec2f normal;  // from self to other
};

// Product of an integer and itself.
PF_HD inline std::uint64_t squared(std::int32_t value) {
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(value) * value);
}

// distance2: of the offset, exactly; below c.touch_distance2. The overlap is a quotient, since a difference
// of distances in float would lose its low digits.
PF_HD inline PairGeometry pair_geometry(const StepConstants& c, Vec2i offset, std::uint64_t distance2,
                                        bool is_lower) {
  PairGeometry pair;
  pair.offset = {static_cast<float>(offset.x), static_cast<float>(offset.y)};
  pair.gap2 = to_float(c.touch_distance2 - distance2);
  pair.distance = std::sqrt(to_float(distance2));
  pair.overlap = pair.gap2 / (c.touch_distance + pair.distance);
  const float inverse = 1.0F / pair.distance;
  pair.normal = distance2 == 0 ? Vec2f{is_lower ? 1.0F : -1.0F, 0.0F} : pair.offset * inverse;
  return pair;
}

PF_HD inline void add_velocity(const StepConstants& c, Vec2f change_mps, ContactSums& sums) {
  sums.add_velocity(to_fixed<kVelocityBits>(change_mps.x * c.per_velocity_step),
                    to_fixed<kVelocityBits>(change_mps.y * c.per_velocity_step));
}

// Pushes each parcel of an overlapping pair away by half the overlap. Method `exact` applies it alone to a
// state that another method left.
struct PushOutContact {
  template <EventTally Tally>
  PF_HD static void respond(const StepConstants& c, const Parcel& self, const Parcel& other,
                            const PairGeometry& pair, ContactSums& sums, Tally& tally) {
    const float push = -0.5F * pair.overlap;
    sums.add_push(to_fixed<kPushBits>(push * pair.normal.x), to_fixed<kPushBits>(push * pair.normal.y));
    if (self.id < other.id) tally.overlap(pair.overlap * c.per_touch_distance);
  }
};

// Change of a parcel's velocity over the speed of approach in a contact of `impulse`.
inline double exchange_of(const ParcelConstants& parcels) {
  return 0.5 * (1.0 + parcels.restitution) * parcels.impulse_scale;
}

// Share of its impulse that a contact of a heated parcel exchanges: if all contacts of a crowd did, it would
// gain no energy, as long as parcels have six neighbours that do not overlap each other (docs/physics.md,
// Contacts).
constexpr float kHeatedShare = 1.0F / 3.0F;

// The seed's method with corrected signs, as a Jacobi step: every contact reads the state before the step.
// Overlapping pairs are pushed apart. Approaching pairs exchange the impulse that makes v_rel,n' = -e v_rel,n
// at impulse_scale 1. In a crowd a parcel may get too much that way from all its contacts together, and the
// crowd would heat up without end; so contacts of parcels that it has heated exchange a share.
struct ImpulseContact {
  static constexpr bool kPushes = true;  // and counts contacts

  template <EventTally Tally>
  PF_HD static void respond(const StepConstants& c, const Parcel& self, const Parcel& other,
                            const PairGeometry& pair, ContactSums& sums, Tally& tally) {
    ++sums.num_contacts;
    PushOutContact::respond(c, self, other, pair, sums, tally);
    const float approach = dot(other.velocity - self.velocity, pair.normal);
    if (!(approach < 0.0F)) return;
    const bool is_heated = (self.is_heated | other.is_heated) != 0;
    const float change = (is_heated ? c.exchange * kHeatedShare : c.exchange) * approach;
    add_velocity(c, pair.normal * change, sums);
    if (self.id < other.id) {
      tally.begin_contact();
      tally.impulse(impulse_counts(-change, c.per_impulse));
    }
  }
};

// Linear spring-dashpot: a force along the normal while the pair overlaps (discrete element method, Cundall
// and Strack 1979). Semi-implicit: the velocity changes first, and the position moves with the new velocity.
// A contact is counted in the step in which the overlap begins.
struct SpringContact {
  static constexpr bool kPushes = false;

  template <EventTally Tally>
  PF_HD static void respond(const StepConstants& c, const Parcel& self, const Parcel& other,
                            const PairGeometry& pair, ContactSums& sums, Tally& tally) {
    const Vec2f relative = other.velocity - self.velocity;
    const float approach = dot(relative, pair.normal);
    const float repulsion_mps = c.spring_mps * pair.overlap - c.damping_share * approach;
    add_velocity(c, pair.normal * -repulsion_mps, sums);
    if (self.id < other.id) {
      tally.overlap(pair.overlap * c.per_touch_distance);
      tally.impulse(impulse_counts(repulsion_mps * (pair.distance * c.per_touch_distance), c.per_impulse));
      // The square of the distance a step ago minus that of the contact distance, without its large terms.
      const Vec2f moved = relative * c.advance;
      if (dot(moved, moved) - 2.0F * dot(pair.offset, moved) >= pair.gap2) tally.begin_contact();
    }
  }
};

// Adds the contact to self's sums if the pair touches. offset: other - self, nearest image.
template <class Contact, EventTally Tally>
PF_HD inline void add_contact(const StepConstants& c, const Parcel& self, const Parcel& other, Vec2i offset,
                              ContactSums& sums, Tally& tally) {
  const std::uint64_t distance2 = squared(offset.x) + squared(offset.y);
  if (distance2 >= c.touch_distance2 || is_retired(other.position)) return;
  Contact::respond(c, self, other, pair_geometry(c, offset, distance2, self.id < other.id), sums, tally);
}

}  // namespace pf
