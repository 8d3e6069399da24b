// The reference against the plainest event-driven simulation: before each event it searches all bodies,
// images and walls for the earliest event. It has no queue and no cells, and keeps no prediction.
#include <gtest/gtest.h>

#include <tuple>

#include "lab/lab_support.hpp"

namespace pf::test {
namespace {

using Kind = ReferenceEvent::Kind;

struct PlainSearch {
  Physics physics;
  ReferenceOptions options;
  std::vector<ReferenceParcel> parcels;
  BallState ball;
  double now = 0.0;
  Vec2d half;

  struct Next {
    double time_s = 1e300;
    Kind kind = Kind::pair;
    std::uint32_t a = 0, b = 0;
    Vec2d offset;  // between the centres at that time: to b, or from the ball

    auto key() const {
      const std::uint32_t rank =
          kind == Kind::pair ? b : 0x80000000U + (kind == Kind::ball ? 0 : 1 + static_cast<int>(kind));
      return std::tuple(time_s, a, rank);
    }
  };
  Next next;

  void consider(double delay, Kind kind, std::uint32_t a, std::uint32_t b, Vec2d offset = {}) {
    const Next candidate{now + std::max(delay, 0.0), kind, a, b, offset};
    if (candidate.key() < next.key()) next = candidate;
  }

  // Roots of |e + v t|^2 = distance^2, over all images.
  void consider_contact(Vec2d e, Vec2d v, double distance, Kind kind, std::uint32_t a, std::uint32_t b) {
    const int images = physics.world.boundary == Boundary::periodic ? 2 : 0;
    for (int ky = -images; ky <= images; ++ky) {
      for (int kx = -images; kx <= images; ++kx) {
        const Vec2d at{e.x + 2.0 * half.x * kx, e.y + 2.0 * half.y * ky};
        const double half_b = dot(at, v), c = dot(at, at) - distance * distance, a2 = dot(v, v);
        if (half_b >= 0.0 || half_b * half_b < a2 * c) continue;
        const double delay = std::max(0.0, (-half_b - std::sqrt(half_b * half_b - a2 * c)) / a2);
        consider(delay, kind, a, b, at + v * delay);
      }
    }
  }

  void consider_edges(Vec2d position, Vec2d velocity, double radius, std::uint32_t body, bool may_leave) {
    const Boundary boundary = physics.world.boundary;
    if (boundary == Boundary::periodic || (boundary == Boundary::open && !may_leave)) return;
    const bool walls = boundary == Boundary::walls;
    const double room = walls ? radius : 0.0;
    const auto axis = [&](double x, double v, double limit, Kind kind) {
      if (v > 0.0) consider((limit - x) / v, kind, body, 0);
      if (v < 0.0) consider((-limit - x) / v, kind, body, 0);
    };
    axis(position.x, velocity.x, half.x - room, walls ? Kind::wall_x : Kind::exit);
    axis(position.y, velocity.y, half.y - room, walls ? Kind::wall_y : Kind::exit);
  }

  void search() {
    next = {};
    const auto num = static_cast<std::uint32_t>(parcels.size());
    for (std::uint32_t i = 0; i < num; ++i) {
      const ReferenceParcel& p = parcels[i];
      if (p.retired) continue;
      consider_edges(p.position_m, p.velocity_mps, physics.parcels.radius_m, i, true);
      if (physics.ball.exists) {
        consider_contact(p.position_m - ball.position_m, p.velocity_mps - ball.velocity_mps,
                         physics.ball.radius_m + physics.parcels.radius_m, Kind::ball, i, 0);
      }
      for (std::uint32_t j = i + 1; j < num; ++j) {
        const ReferenceParcel& q = parcels[j];
        if (q.retired) continue;
        consider_contact(q.position_m - p.position_m, q.velocity_mps - p.velocity_mps,
                         2.0 * physics.parcels.radius_m, Kind::pair, i, j);
      }
    }
    if (physics.ball.exists && !options.ball_frozen) {
      consider_edges(ball.position_m, ball.velocity_mps, physics.ball.radius_m, num, false);
    }
  }

  void move_all(double time_s) {
    for (ReferenceParcel& p : parcels) {
      if (!p.retired) p.position_m += p.velocity_mps * (time_s - now);
      if (physics.world.boundary == Boundary::periodic) {
        p.position_m = {std::remainder(p.position_m.x, 2.0 * half.x),
                        std::remainder(p.position_m.y, 2.0 * half.y)};
      }
    }
    ball.position_m += ball.velocity_mps * (time_s - now);
    now = time_s;
  }

  double restitution(double last_event_s) const {
    const bool lasting = options.contact_clock_s > 0.0 && now - last_event_s <= options.contact_clock_s;
    return lasting ? 1.0 : physics.parcels.restitution;
  }

  void respond() {
    const bool at_ball = next.a == parcels.size();
    Vec2d& velocity = at_ball ? ball.velocity_mps : parcels[next.a].velocity_mps;
    const Vec2d normal = next.offset * (1.0 / length(next.offset));
    if (next.kind == Kind::wall_x) velocity.x = -velocity.x;
    if (next.kind == Kind::wall_y) velocity.y = -velocity.y;
    if (next.kind == Kind::exit) parcels[next.a].retired = true;
    if (next.kind == Kind::pair) {
      ReferenceParcel& q = parcels[next.b];
      const double e = restitution(std::max(parcels[next.a].last_event_s, q.last_event_s));
      const Vec2d change = normal * (0.5 * (1.0 + e) * dot(q.velocity_mps - velocity, normal));
      velocity += change;
      q.velocity_mps -= change;
      q.last_event_s = now;
    }
    if (next.kind == Kind::ball) {
      const ParcelConstants& constants = physics.parcels;
      const BallImpulse impulse =
          ball_impulse(physics.ball, constants, normal, velocity - ball.velocity_mps, ball.spin_radps);
      velocity += impulse.per_mass_mps;
      const double ratio = constants.mass_kg / physics.ball.mass_kg;
      if (!physics.ball.held && !options.ball_frozen) {
        ball.velocity_mps -= impulse.per_mass_mps * ratio;
        ball.spin_radps -=
            impulse.tangential_mps * constants.mass_kg * physics.ball.radius_m / physics.ball.inertia_kg_m2;
      }
    } else if (!at_ball) {
      parcels[next.a].last_event_s = now;
    }
  }
};

struct Case {
  const char* name;
  Boundary boundary;
  std::uint32_t num;
  double area_fraction, ball_radius, ball_mass, restitution, contact_clock_s;
  bool held = false, frozen = false;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class AgainstPlainSearch : public testing::TestWithParam<Case> {};

Physics case_physics(const Case& c) {
  Physics physics;
  const double room = c.num * 0.25 * kPi / c.area_fraction + kPi * c.ball_radius * c.ball_radius;
  physics.world = make_world(std::sqrt(1.2 * room), std::sqrt(room / 1.2), c.boundary);
  physics.parcels = {c.num, 0.5, 1.0, 1.0, c.restitution, 1.0, true};
  physics.ball.exists = c.ball_radius > 0.0;
  physics.ball.held = c.held;
  physics.ball.mass_kg = c.ball_mass;
  physics.ball.radius_m = c.ball_radius;
  physics.ball.inertia_kg_m2 = 2.0 / 3.0 * c.ball_mass * c.ball_radius * c.ball_radius;
  physics.ball.friction = 0.3;
  return physics;
}

// Rounding makes two runs diverge. Per collision of a parcel the difference grows by twice its free path over
// the diameter: by 10 on average at area fraction 0.05, the largest, and by 100 in rare chains
// (docs/physics.md, 'How long two runs can be compared'). Therefore the search restarts from the reference's
// state after every event per parcel (2 collisions). Rounding of times up to 300 is 1e-13.
TEST_P(AgainstPlainSearch, AgreesEventForEvent) {
  const Case& c = GetParam();
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    PlainSearch plain;
    plain.physics = case_physics(c);
    plain.options = {c.frozen, c.contact_clock_s};
    plain.half = to_metres(plain.physics.world, plain.physics.world.half);
    const BallState ball{{0.1, -0.2}, {c.held ? 0.0 : 1.5, c.held ? 0.0 : 0.7}, 2.0, 0.0};
    Reference reference(plain.physics, random_gas(plain.physics, ball, seed), ball, plain.options);
    for (int segment = 0; segment < 24; ++segment) {
      plain.parcels = reference.parcels();
      plain.ball = reference.ball();
      plain.now = reference.now_s();
      for (std::uint32_t k = 0; k < c.num; ++k) {
        plain.search();
        if (plain.next.time_s > 1e200) break;  // all parcels have left
        plain.move_all(plain.next.time_s);
        plain.respond();
        std::vector<ReferenceEvent> events;
        reference.run_until(1e200, &events, 1);
        ASSERT_EQ(events.size(), 1U);
        const auto where = testing::Message() << "seed " << seed << " segment " << segment << " event " << k;
        ASSERT_EQ(events[0].kind, plain.next.kind) << where;
        ASSERT_EQ(events[0].a, plain.next.a) << where;
        ASSERT_EQ(events[0].b, plain.next.b) << where;
        ASSERT_NEAR(events[0].time_s, plain.next.time_s, 1e-6) << where;
      }
      const std::vector<ReferenceParcel> now = reference.parcels();
      for (std::size_t i = 0; i < now.size(); ++i) {
        ASSERT_NEAR(now[i].velocity_mps.x, plain.parcels[i].velocity_mps.x, 1e-5);
        ASSERT_NEAR(now[i].velocity_mps.y, plain.parcels[i].velocity_mps.y, 1e-5);
        ASSERT_EQ(now[i].retired, plain.parcels[i].retired);
      }
      ASSERT_NEAR(reference.ball().spin_radps, plain.ball.spin_radps, 1e-5);
      if (c.frozen) reference.apply_ball_impulses();
    }
  }
}

constexpr double kNoBall = 0.0;
INSTANTIATE_TEST_SUITE_P(
    Sweep, AgainstPlainSearch,
    testing::Values(Case{"walls", Boundary::walls, 40, 0.3, kNoBall, 1.0, 1.0, 0.0},
                    Case{"walls_inelastic_clock", Boundary::walls, 40, 0.3, kNoBall, 1.0, 0.7, 0.05},
                    Case{"periodic_thin", Boundary::periodic, 60, 0.05, kNoBall, 1.0, 1.0, 0.0},
                    Case{"periodic", Boundary::periodic, 60, 0.4, kNoBall, 1.0, 1.0, 0.0},
                    Case{"periodic_2", Boundary::periodic, 2, 0.2, kNoBall, 1.0, 1.0, 0.0},
                    Case{"periodic_3", Boundary::periodic, 3, 0.3, kNoBall, 1.0, 1.0, 0.0},
                    Case{"periodic_5", Boundary::periodic, 5, 0.3, kNoBall, 1.0, 1.0, 0.0},
                    Case{"periodic_9", Boundary::periodic, 9, 0.3, kNoBall, 1.0, 0.9, 0.0},
                    Case{"open", Boundary::open, 60, 0.3, kNoBall, 1.0, 1.0, 0.0},
                    Case{"walls_ball", Boundary::walls, 40, 0.2, 1.5, 20.0, 1.0, 0.0},
                    Case{"walls_light_ball", Boundary::walls, 30, 0.2, 0.7, 0.5, 0.9, 0.1},
                    Case{"periodic_ball", Boundary::periodic, 30, 0.2, 1.5, 20.0, 0.9, 0.0},
                    Case{"periodic_ball_fills", Boundary::periodic, 6, 0.1, 2.0, 20.0, 1.0, 0.0},
                    Case{"periodic_ball_frozen", Boundary::periodic, 30, 0.2, 1.5, 20.0, 1.0, 0.0, false,
                         true},
                    Case{"walls_ball_held", Boundary::walls, 30, 0.2, 1.5, 20.0, 0.9, 0.0, true},
                    Case{"open_ball", Boundary::open, 60, 0.2, 1.0, 50.0, 1.0, 0.0}),
    [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace pf::test
