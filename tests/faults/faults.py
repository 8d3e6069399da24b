"""The faults that plant_faults.py plants in src/model, one per formula.

Each: its name; the file; text that stands in the file once; of that text, the expression that is right and the
one that is wrong; what is wrong then.
"""

from typing import NamedTuple


class Fault(NamedTuple):
    name: str
    file: str
    where: str
    right: str
    wrong: str
    what: str


# Those that found the tests too weak first; ball.hpp and contact.hpp; spring.hpp; step.hpp.
STEPPED = [
    Fault("tc_contact_loses", "exact.hpp", "elastic ? 1.0 :", "1.0", "0.999", "a contact of the TC model loses 0.1 %"),
    Fault("ball_stops_at_wall", "ball.hpp", "x = 2.0 * limit - x;", "2.0 * limit - x", "limit",
          "the ball stops at the wall instead of being reflected by what it overshot"),
    Fault("half_is_kept", "world.hpp", "d >= half", "d >= half", "d > half",
          "of two images half a period away the other one counts as the nearest"),
    Fault("push_out_0.48", "contact.hpp", "-0.5 * overlap", "-0.5", "-0.48", "0.96 of an overlap is pushed out"),
    Fault("same_bits_for_x_and_y", "step.hpp", "random & 0xFFFFU", "random & 0xFFFFU", "random >> 16",
          "x and y are rounded with the same random bits"),
    Fault("rounding_offset", "step.hpp", "(static_cast<std::int64_t>(random16) << 16) + 32768", "32768", "0",
          "positions are rounded down by 2^-17 units on average"),
    Fault("collision_loses", "exact.hpp", "(b - parting) / (2.0 * e2)", "(b - parting)", "(b - 0.9999 * parting)",
          "a collision of `exact` loses 0.01 % of the normal speed"),
    Fault("torque_sign", "ball.hpp", "static_cast<double>(sums.torque) *", "static_cast<double>(sums.torque)",
          "-static_cast<double>(sums.torque)", "friction turns the ball the wrong way"),

    Fault("arc_series", "ball.hpp", "theta * theta / 6.0", "6.0", "5.0", "the arc's chord in the limit of a small turn"),
    Fault("arc_across", "ball.hpp", "(1.0 - turn.cos) / turn_rate", "(1.0 - turn.cos)", "0.999 * (1.0 - turn.cos)",
          "the arc's displacement across the velocity"),
    Fault("drag_of_speed", "ball.hpp", "1.0 + ball.drag_per_m * speed * t", "ball.drag_per_m", "0.999 * ball.drag_per_m",
          "drag slows the ball by 0.1 % too little"),
    Fault("drag_nodes", "ball.hpp", "velocity_at((0.5 - offset) * dt_s)", "offset", "0.99 * offset",
          "a node of the quadrature of the ball's way"),
    Fault("ball_reach", "ball.hpp", "(contact_distance_m + chord_m)", "chord_m", "0.0 * chord_m",
          "the first test for hits forgets that the ball moves"),
    Fault("ball_chord", "ball.hpp", "ball.held ? state.velocity_mps : flight.displacement_m * (1.0 / dt_s)",
          "flight.displacement_m * (1.0 / dt_s)", "state.velocity_mps", "hits see the tangent of the ball's arc"),
    Fault("ball_leaves_wall", "ball.hpp", "v = v > 0.0 ? -v : v;", "v > 0.0 ? -v : v", "-v",
          "a ball beyond a wall that is coming back is sent out again"),
    Fault("ball_wraps_half", "ball.hpp", "x -= 2.0 * half_m", "2.0 * half_m", "1.999 * half_m",
          "the ball comes in beside where it went out"),
    Fault("ball_angle", "ball.hpp", "state.spin_radps * dt_s;", "dt_s", "0.5 * dt_s", "the drawn ball turns half as fast"),
    Fault("ball_impulse_y", "ball.hpp", "static_cast<double>(sums.impulse_y) * per_mass", "per_mass", "0.99 * per_mass",
          "the ball takes 1 % less than parcels give"),
    Fault("cold_drag", "ball.hpp", "2.0 / 3.0 * kappa", "2.0 / 3.0", "0.6", "friction's share of the drag of a cold stream"),
    Fault("hit_share", "ball.hpp", "ball.held ? 1.0 : 1.0 / (1.0 + mass_ratio)", "1.0 / (1.0 + mass_ratio)", "1.0",
          "the ball's recoil is left out of a hit"),
    Fault("hit_restitution", "ball.hpp", "-(1.0 + parcels.restitution)", "parcels.restitution", "1.0",
          "hits of the ball are elastic whatever the restitution"),
    Fault("hit_lever", "ball.hpp", "-slip / (1.0 + mass_ratio + lever)", "lever", "0.0 * lever",
          "stopping the slip forgets that the ball turns"),
    Fault("friction_bound", "ball.hpp", "ball.friction * normal_mps", "ball.friction", "0.99 * ball.friction",
          "Coulomb's bound is 1 % too low"),
    Fault("time_of_impact", "ball.hpp", "-b + sqrt(discriminant)", "discriminant", "0.999 * discriminant",
          "the time of impact is late for all but grazing"),
    Fault("impulse_restitution", "contact.hpp", "(1.0 + parcels.restitution)", "parcels.restitution",
          "parcels.restitution * parcels.restitution", "`impulse` takes the square of the restitution"),
    Fault("impulse_scale", "contact.hpp", "parcels.impulse_scale * approach", "parcels.impulse_scale", "1.0",
          "the seed's factor is left out"),
    Fault("impulse_counts", "contact.hpp", "impulse_mps * c.per_impulse_count", "impulse_mps", "0.98 * impulse_mps",
          "the sum over impulses, which pressure comes from, is 2 % low"),
    Fault("coincident", "contact.hpp", "self_id < other_id ? 1.0 : -1.0", "-1.0", "1.0",
          "both of two parcels in one place go the same way"),
    Fault("contact_test", "contact.hpp", "pair.distance2 >= c.contact_distance2", "pair.distance2",
          "1.0002 * pair.distance2", "contact begins at 0.9999 of the contact distance"),
    Fault("spring_force", "contact.hpp", "c.spring_rate_per_s2 * overlap", "c.spring_rate_per_s2",
          "0.98 * c.spring_rate_per_s2", "the spring is 2 % too soft"),
    Fault("spring_damping", "contact.hpp", "c.damping_rate_per_s * approach", "c.damping_rate_per_s",
          "0.9 * c.damping_rate_per_s", "the dashpot is 10 % too weak"),
    Fault("spring_count", "contact.hpp", "pair.offset * unit_m - relative * c.dt_s", "c.dt_s", "-c.dt_s",
          "`spring` counts the ends of contacts"),
    Fault("spring_impulse", "contact.hpp", "repulsion_mps * pair.distance / c.contact_distance", "repulsion_mps",
          "1.02 * repulsion_mps", "`spring` reports 2 % too much impulse"),
    Fault("spring_frequency", "spring.hpp", "frequency * frequency + damping * damping", "damping * damping",
          "0.0 * damping", "the spring is made without what damping takes from its frequency"),
    Fault("spring_rate_of_damping", "spring.hpp", "-natural_log(std::fmax(restitution, 1e-3)) / contact_s", "contact_s",
          "(1.02 * contact_s)", "the dashpot is made for a contact that lasts 2 % longer"),
    Fault("spring_limit", "spring.hpp", "2.0 * (std::sqrt(g * g", "2.0", "2.1", "the stability bound is 5 % too high"),
    Fault("after_the_hit", "step.hpp", "displacement(c, velocity, 1.0 - before)", "1.0 - before", "1.0",
          "a parcel moves for a whole step after it hit the ball"),
    Fault("before_the_hit", "step.hpp", "displacement(c, velocity, before)", "before", "0.0",
          "a parcel does not move up to the ball that it hits"),
    Fault("hit_push_out", "step.hpp", "overlap_units > 1.0 ?", "overlap_units > 1.0", "overlap_units > 1e30",
          "a parcel inside the ball is not pushed out"),
    Fault("hit_torque", "step.hpp", "-impulse.tangential_mps * c.per_impulse_unit", "c.per_impulse_unit",
          "0.99 * c.per_impulse_unit", "the ball takes 1 % less of the friction"),
    Fault("parcel_reach", "step.hpp", "+ own + 2", "own", "0 * own", "the first test for hits forgets that parcels move"),
    Fault("wall_overshoot", "step.hpp", "position = 2 * limit - position", "2 * limit - position", "limit",
          "a parcel stops at the wall instead of being reflected by what it overshot"),
    Fault("wall_radius_of_step", "step.hpp", "c.contact_reach / 2", "c.contact_reach / 2", "0",
          "walls reflect centres instead of rims"),
    Fault("open_edge", "step.hpp", "return position >= -static_cast<std::int64_t>(half)", "half", "half - half / 64",
          "parcels retire before the edge"),
    Fault("periodic_edge", "step.hpp", "2LL * half", "2LL * half", "2LL * half - 2000",
          "parcels come in 2000 units beside where they went out"),
    Fault("push_rounding", "step.hpp", "(sums.push_x + 32768) >> 16", "32768", "0", "push-outs are rounded down"),
    Fault("rounding_key", "step.hpp", "random_bits(seed, step, 0x726F756EULL)", "step", "0 * step",
          "each step rounds with the same random bits"),
]
