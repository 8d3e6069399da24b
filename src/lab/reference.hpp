// The lab's reference: serial event-driven simulation of hard discs in double precision (Alder and Wainwright
// 1959). Bodies fly on straight lines; the earliest event of all is carried out, then what it changed is
// predicted anew. Nothing is rounded but by double arithmetic, and no event code is shared with the methods
// it judges.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "backend/backend.hpp"
#include "lab/event_tree.hpp"

namespace pf {

struct ReferenceParcel {
  Vec2d position_m;
  Vec2d velocity_mps;
  bool retired = false;
  double last_event_s = -std::numeric_limits<double>::infinity();  // its contact clock
};

struct ReferenceEvent {
  enum class Kind : std::uint8_t { pair, ball, wall_x, wall_y, exit };
  double time_s = 0.0;
  Kind kind = Kind::pair;
  std::uint32_t a = 0;  // parcel (the lower of a pair); the number of parcels stands for the ball
  std::uint32_t b = 0;  // higher parcel of a pair, else 0

  bool operator==(const ReferenceEvent&) const = default;
};

struct ReferenceOptions {
  // The ball keeps its velocity and spin until apply_ball_impulses(), and does not see walls before.
  bool ball_frozen = false;
  // Contact clock t_c [s], >= 0, 0 = off (Luding and McNamara 1998): a collision of two parcels dissipates
  // only if more than t_c passed since the last event with a parcel or wall of both; one with the ball looks
  // at the parcel's clock and does not set it.
  double contact_clock_s = 0.0;
};

struct ReferenceTotals {
  std::uint64_t num_collisions = 0;  // of two parcels
  std::uint64_t num_ball_hits = 0;
  std::uint64_t num_wall_hits = 0;  // of parcels
  std::uint64_t num_exits = 0;
  std::uint64_t num_cell_changes = 0;
  std::uint64_t num_predictions = 0;
  double impulse_sum_mps = 0.0;  // over collisions of two parcels: |impulse| / parcel mass
  double max_overlap_m = 0.0;    // largest seen at a collision of two parcels or with the ball
  Vec2d ball_impulse_kg_mps;     // what parcels did to the ball, also when it is held or frozen
  double ball_torque_impulse_kg_m2ps = 0.0;
};

class Reference {
 public:
  // Time starts at 0. Takes world, parcels and ball constants of physics; Magnus and drag are left out: the
  // ball flies straight between hits. A held ball stays where it is, with velocity 0 and its spin.
  // Walls: rims reflect. Open: a parcel whose centre leaves is retired; the ball flies on.
  // Throws UserError if restitution is not in (0, 1], impulse_scale is not 1, contact_clock_s < 0, there are
  // no parcels, or a side of the world is below two parcel diameters (or two ball contact distances).
  Reference(const Physics& physics, const std::vector<ReferenceParcel>& parcels, const BallState& ball,
            const ReferenceOptions& options = {});

  // Carries out all events up to time_s (>= now), appending them to events if given. Stops early, and returns
  // false, after max_events of them: with restitution < 1 and no contact clock time may cease to pass.
  bool run_until(double time_s, std::vector<ReferenceEvent>* events = nullptr,
                 std::uint64_t max_events = UINT64_MAX);

  double now_s() const { return now_; }
  const ReferenceTotals& totals() const { return totals_; }
  Measures measure() const;

  // By id, at the present time (retired ones where they left); inside the world if periodic.
  std::vector<ReferenceParcel> parcels() const;
  BallState ball() const;  // its angle is left 0

  // Frozen ball: gives it the impulses summed since the last call, then reflects or wraps it at the boundary.
  void apply_ball_impulses();
  // Replaces the ball's state.
  void set_ball(const BallState& ball);

 private:
  // On a line since time_s; 64 bytes, a cache line.
  struct alignas(64) Body {
    Vec2d position;
    Vec2d velocity;
    double time_s = 0.0;
    std::uint32_t cell_x = 0, cell_y = 0;
    std::uint32_t next = 0, previous = 0;  // in the list of its cell
    std::uint32_t num_changes = 0;         // of its line; an event planned with an older line is void
    std::uint32_t changes_of_other = 0;    // num_changes of whom it meets next, when that was predicted
  };

  void check() const;
  bool is_void(const PlannedEvent& event) const;
  bool carry_out(const PlannedEvent& event);
  ReferenceEvent record(const PlannedEvent& event) const;
  void advance(Body& body) const;
  void collide(std::uint32_t i, std::uint32_t j);
  double restitution_now(std::uint32_t i, std::uint32_t j) const;
  void hit_ball(std::uint32_t i);
  void give_ball_its_impulses();
  void reflect(std::uint32_t i, bool along_x);
  void reflect_ball(bool along_x);
  void retire(std::uint32_t i);

  Vec2d nearest_image(Vec2d offset) const;
  void make_cells();
  std::uint32_t cell_of(const Body& body) const { return body.cell_y * num_cells_x_ + body.cell_x; }
  void place_in_cell(std::uint32_t i);
  void enter_cell(std::uint32_t i);
  void leave_cell(std::uint32_t i);
  void move_to_next_cell(std::uint32_t i, bool along_x);

  void predict(std::uint32_t i);
  void predict_edge(const Body& body, PlannedEvent& earliest) const;
  void predict_pairs(const Body& body, PlannedEvent& earliest) const;
  void predict_with(const Body& body, std::uint32_t first, Vec2d shift, PlannedEvent& earliest) const;
  void predict_ball_hit(const Body& body, PlannedEvent& earliest) const;
  void predict_ball();
  void refresh_ball();

  Physics physics_;
  ReferenceOptions options_;
  Vec2d half_m_;  // half extents of the world
  Vec2d side_m_;  // of a periodic world; else 0
  double contact_m_;
  double now_ = 0.0;
  ReferenceTotals totals_;

  std::vector<Body> bodies_;
  std::vector<std::uint8_t> retired_;
  std::vector<double> clock_;  // last event with a parcel or a wall
  EventTree tree_;             // the leaf after the parcels' is the ball's

  std::uint32_t num_cells_x_ = 1, num_cells_y_ = 1;
  Vec2d cell_m_;
  std::vector<std::uint32_t> cell_head_;  // first parcel of each cell

  Body ball_;
  double ball_spin_ = 0.0;
  double ball_contact_m_;
  Vec2d pending_impulse_;            // on the ball, over parcel mass
  double pending_tangential_ = 0.0;  // the same of the part that turns it
  // The ball's zone: the cells from which a parcel could hit it while it stays within zone_margin_m_ of where
  // it was when the zone was made.
  double zone_margin_m_ = 0.0;
  std::vector<std::uint8_t> in_zone_;  // by cell
  std::vector<std::uint32_t> zone_;
};

// The parcels of a backend's state.
std::vector<ReferenceParcel> reference_parcels(const World& world, const ParcelSnapshot& snapshot);

}  // namespace pf
