#include "view/path_svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"
#include "view/court_lines.hpp"
#include "view/current_color.hpp"

namespace pf {
namespace {

std::string hex(const Rgb& color) {
  const auto byte = [](float part) { return static_cast<int>(std::lround(255.0F * part)); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(color[0]), byte(color[1]), byte(color[2]));
}

std::string rectangle(Vec2d half_m, const char* style) {
  return fmt::format("<rect x=\"{:.6g}\" y=\"{:.6g}\" width=\"{:.6g}\" height=\"{:.6g}\" {}/>\n", -half_m.x,
                     -half_m.y, 2.0 * half_m.x, 2.0 * half_m.y, style);
}

std::string line(double x0, double y0, double x1, double y1) {
  return fmt::format("<path d=\"M{:.6g} {:.6g}L{:.6g} {:.6g}\"/>\n", x0, y0, x1, y1);
}

// The lines of the court, drawn along their middles, and the net.
std::string court_lines() {
  using namespace court;
  std::string lines =
      fmt::format("<g fill=\"none\" stroke=\"#8a979d\" stroke-width=\"{:.6g}\">\n", 2.0 * kHalfLine_m);
  lines += rectangle({kHalfLength_m - kHalfLine_m, kHalfWidth_m - kHalfLine_m}, "");
  for (const double side : {-1.0, 1.0}) {
    lines += line(side * kZone_m, -kHalfWidth_m, side * kZone_m, kHalfWidth_m);
    lines += line(side * kZone_m, 0.0, side * kHalfLength_m, 0.0);
  }
  return lines + line(0.0, -kHalfPosts_m, 0.0, kHalfPosts_m) + "</g>\n";
}

std::string ground(Vec2d half_m, Boundary boundary) {
  const std::string dashed = boundary == Boundary::open ? " stroke-dasharray=\"0.1\"" : "";
  const std::string frame =
      fmt::format("fill=\"none\" stroke=\"#b8c2c7\" stroke-width=\"{:.6g}\"{}", 0.002 * half_m.x, dashed);
  const bool is_court = court::fits(2.0 * half_m.x, 2.0 * half_m.y);
  return rectangle(half_m, frame.c_str()) + (is_court ? court_lines() : "");
}

struct Stroke {
  std::string color;
  double width_m = 0.01;
  double dash_m = 0.0;
  std::string title;
};

std::string polyline(const std::vector<Vec2f>& points_m, const Stroke& stroke) {
  if (points_m.size() < 2) return "";
  std::string points;
  for (const Vec2f& point : points_m)
    points += fmt::format("{}{:.6g},{:.6g}", points.empty() ? "" : " ", point.x, -point.y);
  const std::string dash = stroke.dash_m > 0.0 ? fmt::format(" stroke-dasharray=\"{:.6g} {:.6g}\"",
                                                             0.6 * stroke.dash_m, 0.4 * stroke.dash_m)
                                               : "";
  return fmt::format(
      "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"{:.6g}\" stroke-linejoin=\"round\"{} "
      "points=\"{}\"><title>{}</title></polyline>\n",
      stroke.color, stroke.width_m, dash, points, xml_text(stroke.title));
}

std::string flight_title(const FlightRecord& flight) {
  return fmt::format("flight {}: {}, {:.4g} m/s, {:.4g} rad/s, {:.4g} s", flight.number,
                     name_of_flight(flight), length(flight.launch_mps), flight.spin_radps, flight.time_s());
}

// For white paper, as in the light theme.
std::string paths(const FrameView& frame, const Look& look, double line_m) {
  std::string text;
  if (frame.old_flights != nullptr) {
    for (auto old = frame.old_flights->rbegin(); old != frame.old_flights->rend(); ++old)
      text += polyline(old->points_m,
                       {hex(flight_color(Theme::light, *old)), 0.7 * line_m, 0.0, flight_title(*old)});
  }
  if (look.ghosts && frame.ghosts != nullptr) {
    for (const Ghost& ghost : *frame.ghosts) {
      const std::string title = std::string("ghost: ") + air_name(ghost.air);
      text += polyline(ghost.points_m, {hex(theme_colors(Theme::light).ghost), 0.7 * line_m,
                                        ghost_dash_px(ghost.air) * 0.6 * line_m, title});
    }
  }
  if (frame.flight_record == nullptr) return text;
  return text + polyline(frame.flight_record->points_m, {hex(current_flight_color(Theme::light, frame)),
                                                         line_m, 0.0, flight_title(*frame.flight_record)});
}

}  // namespace

std::string path_svg(const FrameView& frame, const Look& look) {
  const World& world = frame.physics->world;
  const Vec2d half_m = to_metres(world, world.half);
  const double margin_m = 0.03 * std::max(half_m.x, half_m.y) + frame.physics->ball.radius_m;
  const Vec2d size_m = Vec2d{half_m.x + margin_m, half_m.y + margin_m} * 2.0;
  const double line_m = 0.0025 * std::max(half_m.x, half_m.y);
  std::string svg = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
      "viewBox=\"{:.6g} {:.6g} {:.6g} {:.6g}\" width=\"1280\" height=\"{:.0f}\">\n",
      -0.5 * size_m.x, -0.5 * size_m.y, size_m.x, size_m.y, std::ceil(1280.0 * size_m.y / size_m.x));
  svg +=
      fmt::format("<title>{}</title>\n<desc>{}\nLengths are in metres; t = {:.6g} s</desc>\n",
                  xml_text(frame.settings->name), xml_text(frame.settings->description), frame.simulated_s);
  svg += ground(half_m, world.boundary) + paths(frame, look, line_m);
  if (frame.physics->ball.exists) {
    svg += fmt::format(
        "<circle cx=\"{:.6g}\" cy=\"{:.6g}\" r=\"{:.6g}\" fill=\"#f2d43f\" stroke=\"#3c3710\" "
        "stroke-width=\"{:.6g}\"><title>ball</title></circle>\n",
        frame.ball.position_m.x, -frame.ball.position_m.y, frame.physics->ball.radius_m, 0.4 * line_m);
  }
  return svg + "</svg>\n";
}

void write_svg(const std::filesystem::path& file, const std::string& svg) {
  const std::string problem = replace_file(file, svg);
  if (problem.empty()) return;
  throw UserError(fmt::format("{}: the drawing cannot be written ({}); choose another file",
                              in_quotes(file.string()), problem));
}

}  // namespace pf
