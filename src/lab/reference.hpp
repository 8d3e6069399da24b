// The lab's reference: a serial event-driven simulation of hard discs in double precision (Alder and
// Wainwright 1959). Bodies fly straight; the earliest event of all is applied, then the bodies that it
// changed are predicted again. Double arithmetic is the only rounding. The reference shares no event code
// with the methods that it judges.
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
  double last_event_s = -std::numeric_limits<double>::infinity();  // with a parcel or a wall
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
  // The ball keeps its velocity and spin until apply_ball_impulses(), and ignores walls until then.
  bool ball_frozen = false;
  // Contact duration t_c of the TC model [s], >= 0, 0 = off (Luding and McNamara 1998). A collision of two
  // parcels loses energy only if the last contact of both, with a parcel or a wall, is more than t_c ago. A
  // collision with the ball always loses energy, and is no such contact.
  double contact_clock_s = 0.0;
};

struct ReferenceTotals {
  std::uint64_t num_collisions = 0;  // of two parcels
  std::uint64_t num_ball_hits = 0;
  std::uint64_t num_wall_hits = 0;  // of parcels
  std::uint64_t num_exits = 0;
  double impulse_sum_mps = 0.0;  // over collisions of two parcels: |impulse| / parcel mass
  double max_overlap_m = 0.0;    // largest at a collision of two parcels or with the ball
  Vec2d ball_impulse_kg_mps;     // of all hits on the ball, also when it is held or frozen
  double ball_torque_impulse_kg_m2ps = 0.0;
};

// Cells along one axis of the world.
struct CellAxis {
  double half_m = 0.0;  // half extent of the world
  double cell_m = 0.0;  // width of a cell
  std::uint32_t num_cells = 1;
};

class Reference {
 public:
  // Time starts at 0. Reads world, parcels and ball constants of physics, without Magnus and drag: the ball
  // flies straight between hits. A held ball stays in place, with velocity 0 and its spin. Walls reflect
  // rims. An open edge retires a parcel whose centre leaves; the ball flies on. Throws UserError if
  // restitution is not in (0, 1], impulse_scale is not 1, contact_clock_s < 0, there are no parcels, or a
  // side of a periodic world is below two parcel diameters (or two ball contact distances).
  Reference(const Physics& physics, const std::vector<ReferenceParcel>& parcels, const BallState& ball,
            const ReferenceOptions& options = {});

  // Applies all events up to time_s (>= now) and appends them to `events` if given. Returns false if it stops
  // early, after max_events of them: with restitution < 1 and no contact duration time may cease to advance.
  bool run_until(double time_s, std::vector<ReferenceEvent>* events = nullptr,
                 std::uint64_t max_events = UINT64_MAX);

  double now_s() const { return now_; }
  const ReferenceTotals& totals() const { return totals_; }
  Measures measure() const;

  // By id, at the current time; a retired one where it left. Inside the world if that is periodic.
  std::vector<ReferenceParcel> parcels() const;
  BallState ball() const;  // its angle is left 0

  // Applies the impulses summed since the last call to a frozen ball, then reflects or wraps it at the
  // boundary.
  void apply_ball_impulses();
  // Replaces the ball's state.
  void set_ball(const BallState& ball);

 private:
  // A trajectory since time_s; 64 bytes, a cache line.
  struct alignas(64) Body {
    Vec2d position;
    Vec2d velocity;
    double time_s = 0.0;
    std::uint32_t cell_x = 0, cell_y = 0;
    std::uint32_t next = 0, previous = 0;  // in the list of its cell
    std::uint32_t num_changes = 0;         // of its trajectory; a change makes earlier predictions stale
    std::uint32_t partner_changes = 0;     // num_changes of its predicted partner, at the prediction
  };

  void check() const;
  bool is_stale(const PredictedEvent& event) const;
  bool apply_event(const PredictedEvent& event);
  ReferenceEvent record_of(const PredictedEvent& event) const;
  void advance(Body& body) const;
  void collide(std::uint32_t i, std::uint32_t j);
  double current_restitution(std::uint32_t i, std::uint32_t j) const;
  void collide_with_ball(std::uint32_t i);
  void exchange_with_ball(Body& body, Vec2d offset, double distance);
  bool ball_is_free() const { return !options_.ball_frozen && !physics_.ball.held; }
  void apply_pending_impulses();
  void reflect(std::uint32_t i, bool along_x);
  void reflect_ball(bool along_x);
  void retire(std::uint32_t i);

  Vec2d nearest_image(Vec2d offset) const;
  void make_cells();
  std::uint32_t cell_of(const Body& body) const { return body.cell_y * axis_x_.num_cells + body.cell_x; }
  void place_in_cell(std::uint32_t i);
  void enter_cell(std::uint32_t i);
  void leave_cell(std::uint32_t i);
  void move_to_next_cell(std::uint32_t i, bool along_x);

  void predict(std::uint32_t i);
  void predict_edge(const Body& body, PredictedEvent& earliest) const;
  void predict_pairs(const Body& body, PredictedEvent& earliest) const;
  void predict_pairs_in(std::uint32_t first, const Body& body, Vec2d shift, PredictedEvent& earliest) const;
  void predict_ball_hit(const Body& body, PredictedEvent& earliest) const;
  void predict_ball();
  void collect_ball_zone();
  void update_ball();

  Physics physics_;
  ReferenceOptions options_;
  CellAxis axis_x_, axis_y_;
  Vec2d side_m_;  // of a periodic world; else 0
  double contact_m_;
  double now_ = 0.0;
  ReferenceTotals totals_;

  std::vector<Body> bodies_;
  std::vector<std::uint8_t> retired_;
  std::vector<double> last_contact_s_;  // with a parcel or a wall
  EventTree tree_;                      // the leaf after the parcels' is the ball's

  std::vector<std::uint32_t> cell_head_;  // first parcel of each cell

  Body ball_;
  double ball_spin_ = 0.0;
  double ball_contact_m_;
  Vec2d pending_impulse_;            // on the ball, over parcel mass
  double pending_tangential_ = 0.0;  // its part that turns the ball
  // The ball's zone: the cells from which a parcel could hit the ball while that stays within zone_margin_m_
  // of its position at the zone's making.
  double zone_margin_m_ = 0.0;
  std::vector<std::uint8_t> in_zone_;  // by cell
  std::vector<std::uint32_t> zone_;
};

// The parcels of a backend's state.
std::vector<ReferenceParcel> reference_parcels(const World& world, const ParcelSnapshot& snapshot);

}  // namespace pf
