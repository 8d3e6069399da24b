#include "view/accuracy_section.hpp"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "app/accuracy_table.hpp"
#include "core/error.hpp"
#include "model/methods.hpp"
#include "scene/derive.hpp"
#include "view/figure_text.hpp"
#include "view/overlay_paint.hpp"
#include "view/slide.hpp"

namespace pf {
namespace {

ImU32 method_color(std::size_t method, Theme theme) {
  return packed(pf::method_color(theme, static_cast<Method>(method)));
}

// In per cent, as in the legend of the flights.
std::string signed_text(double share) { return std::isfinite(share) ? drift_text(share) : "-"; }
std::string plain_text(double share) { return std::isfinite(share) ? digits(100.0 * share) + " %" : "-"; }

void row(SettingRows& rows, const char* label, const std::string& value, const std::string& help) {
  rows.begin_row(label, help);
  ImGui::TextUnformatted(value.c_str());
  rows.end_row(label, help);
}

std::string ratio_text(double ratio, double error) {
  return std::isfinite(ratio) ? fmt::format("{:.3f} \xC2\xB1 {:.2g}", ratio, error) : "-";
}

void show_readout(SettingRows& rows, const FrameView& frame, const AccuracyReadout& r) {
  const bool loses = frame.physics->parcels.restitution < 1.0;
  row(rows, "Energy drift", signed_text(r.energy_drift) + (loses ? " (e < 1 loses some)" : ""),
      "relative, of parcels and ball together, since the last launch or change of a setting, or "
      "since this section was opened; with a restitution below 1 a loss is physics");
  row(rows, "Momentum drift", plain_text(r.momentum_drift),
      "relative to the sum of all |m v|; walls, a held ball and the Magnus term change momentum, and that "
      "is physics");
  if (r.free_flow) {
    row(rows, "Drag / theory", ratio_text(r.free_flow->drag_over_theory, r.free_flow->drag_error),
        "force on the held ball along the stream over that of free-molecular flow past a smooth disc (Schaaf "
        "and Chambre 1961), with its statistical error; it holds until parcels that hit the ball return "
        "through the periodic world");
    row(rows, "Hits / theory", ratio_text(r.free_flow->hits_over_theory, r.free_flow->hits_error),
        "hits on the held ball over those of free-molecular flow, with their statistical error");
  }
  row(rows, "Rate / Enskog", ratio_text(r.rate_over_enskog, r.rate_error),
      "collisions counted over those of a gas in equilibrium, with their statistical error; fewer in the "
      "first mean free times, since parcels start evenly spaced, and near open edges; a gas that cools in "
      "clusters, or one that a ball stirs, is not in equilibrium either");
  row(rows, "Missed hits",
      std::isfinite(r.missed_fraction) ? fmt::format("{:.2g} %", 100.0 * r.missed_fraction) : "-",
      "share of collisions that steps so long do not see, by theory; exact sees all");
  row(rows, "Parcels gone", fmt::format("{}", r.num_retired), "parcels that have left an open world");
  row(rows, "Largest overlap", fmt::format("{:.2g} diameters", r.max_overlap_diameters),
      fmt::format("at a contact, over {:.3g} s simulated and {} collisions", r.simulated_s,
                  r.num_collisions));
}

std::string expected_text(const AccuracyChoice& choice) {
  if (choice.expected_error <= 0.0) return "no error resolved";
  return fmt::format("{} by the method within {}{:.2g} %", choice.of, choice.is_bound ? "less than " : "",
                     100.0 * choice.expected_error);
}

// A rectangle of the screen with logarithmic axes. An error of 0 lies at its lower edge.
struct Axes {
  ImVec2 low, high;  // corners: left top, right bottom
  double min_cost, max_cost, min_error, max_error;

  ImVec2 place(const WorkPrecisionPoint& point) const {
    const auto share = [](double value, double first, double last) {
      return static_cast<float>(std::clamp(std::log(value / first) / std::log(last / first), 0.0, 1.0));
    };
    return {low.x + (high.x - low.x) * share(point.ns_per_disc_time, min_cost, max_cost),
            high.y - (high.y - low.y) * share(point.error, min_error, max_error)};
  }
};

std::optional<Axes> axes_of(const WorkPrecision& picture, ImVec2 low, ImVec2 high) {
  Axes axes{low, high, 1e300, 0.0, 1e300, 0.0};
  for (const auto& points : picture.methods) {
    for (const WorkPrecisionPoint& point : points) {
      axes.min_cost = std::min(axes.min_cost, point.ns_per_disc_time);
      axes.max_cost = std::max(axes.max_cost, point.ns_per_disc_time);
      if (point.error > 0.0) axes.min_error = std::min(axes.min_error, point.error);
      axes.max_error = std::max(axes.max_error, point.error);
    }
  }
  axes.min_cost *= 0.8;
  axes.max_cost *= 1.25;
  axes.min_error *= 0.7;
  axes.max_error *= 1.4;
  const bool is_plane = axes.max_cost > axes.min_cost && axes.max_error > axes.min_error;
  return is_plane && axes.min_error > 0.0 ? std::optional(axes) : std::nullopt;
}

void draw_errors(ImDrawList* list, const Axes& axes, const OverlayColors& colors) {
  const float size = 0.8F * ImGui::GetFontSize();
  for (double error = 1e-6; error < 10.0; error *= 10.0) {
    if (error < axes.min_error || error > axes.max_error) continue;
    const ImVec2 at = axes.place({axes.min_cost, error});
    list->AddLine(at, ImVec2(axes.high.x, at.y), colors.edge);
    list->AddText(ImGui::GetFont(), size, ImVec2(at.x + 3.0F, at.y - size), colors.dim,
                  fmt::format("{:g} %", 100.0 * error).c_str());
  }
}

// Costs to mark: powers of ten, or also twice and five times these where there are fewer than two.
std::vector<double> marked_costs(const Axes& axes) {
  std::vector<double> decades, all;
  for (double decade = 1e-3; decade < 1e9; decade *= 10.0) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double cost = factor * decade;
      if (cost < axes.min_cost || cost > axes.max_cost) continue;
      all.push_back(cost);
      if (factor == 1.0) decades.push_back(cost);
    }
  }
  return decades.size() < 2 ? all : decades;
}

void draw_costs(ImDrawList* list, const Axes& axes, const OverlayColors& colors) {
  const float size = 0.8F * ImGui::GetFontSize();
  float free_from = axes.low.x;
  for (const double cost : marked_costs(axes)) {
    const ImVec2 at = axes.place({cost, axes.min_error});
    list->AddLine(ImVec2(at.x, axes.low.y), at, colors.edge);
    const std::string text = fmt::format("{:g} ns", cost);
    const float width = text_width(text, 0.8F);
    const float left = std::clamp(at.x - 0.5F * width, axes.low.x + 2.0F, axes.high.x - width - 2.0F);
    if (left < free_from) continue;
    list->AddText(ImGui::GetFont(), size, ImVec2(left, axes.high.y + 0.4F * size), colors.dim, text.c_str());
    free_from = left + width + size;
  }
}

void draw_methods(ImDrawList* list, const Axes& axes, const WorkPrecision& picture, Theme theme) {
  const float thick = ImGui::GetFontSize() / 9.0F;
  for (std::size_t k = 0; k < picture.methods.size(); ++k) {
    const auto& points = picture.methods[k];
    const ImU32 color = method_color(k, theme);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ImVec2 at = axes.place(points[i]);
      if (i > 0 && k != static_cast<std::size_t>(Method::exact))
        list->AddLine(axes.place(points[i - 1]), at, color, thick);
      list->AddCircleFilled(at, 1.6F * thick, color);
    }
  }
}

// Above the axes.
void draw_names(ImDrawList* list, const Axes& axes, Theme theme) {
  const float size = 0.85F * ImGui::GetFontSize();
  float right = axes.high.x - 4.0F;
  for (std::size_t k = kMethods.size(); k-- > 0;) {
    right -= text_width(kMethods[k].name, 0.85F);
    list->AddText(ImGui::GetFont(), size, ImVec2(right, axes.low.y - 1.25F * size), method_color(k, theme),
                  kMethods[k].name);
    right -= size;
  }
}

}  // namespace

void AccuracySection::load_table() {
  if (loaded_) return;
  loaded_ = true;
  try {
    table_ = read_accuracy_table(accuracy_table_file());
  } catch (const UserError& error) {
    note_ = error.what();
  }
}

std::string AccuracySection::target(const Settings& settings) const {
  if (of_ > 0) return accuracy_targets()[static_cast<std::size_t>(of_ - 1)];
  return target_of(settings);
}

void AccuracySection::edit(SettingRows& rows, const FrameView& frame, const AccuracyReadout* readout,
                           Theme theme) {
  load_table();
  show_readout(rows, frame, readout != nullptr ? *readout : AccuracyReadout{});
  const bool has_parcels = rows.edited().air == Air::parcels;
  ImGui::BeginDisabled(!has_parcels || !table_);
  const std::string of_help = "the quantity whose error is bounded; drag and path are the ball's";
  std::vector<std::string> names = {"by scene"};
  names.insert(names.end(), accuracy_targets().begin(), accuracy_targets().end());
  of_ = rows.menu("Error of", of_help, "##accuracy of", names, of_);
  const std::string help =
      "--accuracy: the cheapest method and time step with at most this error, by the table of 'pickleflight "
      "lab work-precision'; the number of parcels stays. Takes effect when you let go, or with Enter.";
  rows.begin_row("Accuracy", help);
  double percent = rows.held_or("Accuracy", percent_);
  const bool moved = slide<double>("##accuracy", percent, {0.1, 50.0}, "%.2f %%",
                                   ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_NoRoundToFormat);
  const auto number = rows.take_finished("Accuracy", percent, moved, true, {1e-3, 99.0, "%"});
  rows.end_row("Accuracy", help);
  ImGui::EndDisabled();
  rows.show_refusal("Accuracy");
  percent_ = number.value_or(percent_);
  if (number) choose(rows, frame);
  if (!note_.empty()) ImGui::TextWrapped("%s", note_.c_str());
  if (has_parcels && table_) plot(rows, frame, theme);
}

void AccuracySection::choose(SettingRows& rows, const FrameView& frame) {
  const AccuracyWish wish = {0.01 * percent_, target(rows.edited()), true, frame.refused};
  try {
    const AccuracyChoice choice = choose_by_accuracy(*table_, rows.edited(), wish, frame.backend);
    rows.edited() = choice.settings;
    rows.mark_changed();
    note_ = fmt::format("{}: {}", method_name(choice.settings.method), expected_text(choice));
    if (!choice.remarks.empty()) note_ += "; " + choice.remarks.front();
  } catch (const UserError& error) {
    note_ = error.what();
  }
}

// Error upwards, cost to the right, both logarithmic. The dot is the current setting.
void AccuracySection::plot(SettingRows& rows, const FrameView& frame, Theme theme) const {
  const Settings& settings = *frame.settings;
  const FramePlan plan = plan_frame(settings, *frame.physics, frame.ball);
  const double displacement = displacement_of_step(settings, *frame.physics, frame.ball, plan.dt_s);
  const WorkPrecision picture =
      work_precision(*table_, settings, target(settings), frame.backend, displacement);
  const float font = ImGui::GetFontSize();
  const ImVec2 low = ImGui::GetCursorScreenPos();
  const ImVec2 size(ImGui::GetContentRegionAvail().x, 10.5F * font);
  ImGui::InvisibleButton("##work-precision", size);
  rows.end_row(
      "Work-precision",
      fmt::format("error of {} over cost in nanoseconds per disc and time d/c, at area fraction {:g} and "
                  "restitution {:g}, the nearest of the table. The dot: "
                  "the current setting{}",
                  picture.of, picture.area_fraction, picture.restitution,
                  picture.current ? fmt::format(", {:.3g} ns, {:.2g} %", picture.current->ns_per_disc_time,
                                                100.0 * picture.current->error)
                                  : " has none"));
  const ImVec2 high(low.x + size.x, low.y + size.y);
  const OverlayColors& colors = overlay_colors(theme);
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRectFilled(low, high, colors.plot);
  // Names stand above the axes; the costs and the caption below, clear of points with an error of 0.
  const auto axes =
      axes_of(picture, ImVec2(low.x, low.y + 1.2F * font), ImVec2(high.x, high.y - 2.2F * font));
  if (!axes) return;
  draw_errors(list, *axes, colors);
  draw_costs(list, *axes, colors);
  draw_methods(list, *axes, picture, theme);
  draw_names(list, *axes, theme);
  const std::string caption = fmt::format("error of {}; cost per disc and time d/c \xE2\x86\x92", picture.of);
  list->AddText(ImGui::GetFont(), 0.85F * font, ImVec2(low.x + 0.3F * font, high.y - 1.05F * font),
                colors.dim, caption.c_str());
  if (!picture.current) return;
  const ImVec2 at = axes->place(*picture.current);
  list->AddCircleFilled(at, 0.42F * font, colors.plot);
  list->AddCircleFilled(at, 0.32F * font, colors.accent);
}

}  // namespace pf
