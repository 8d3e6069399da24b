#include "view/split_section.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <imgui.h>

#include <algorithm>

#include "app/options.hpp"
#include "core/error.hpp"
#include "model/methods.hpp"

namespace pf {
namespace {

struct Offer {
  std::string name;
  Difference difference;
};

std::vector<Offer> offers(const FrameView& frame, const Difference& current) {
  std::vector<Offer> all = {{"next method", {kNextMethod}}};
  for (const MethodRow& method : kMethods)
    all.push_back({std::string("method ") + method.name, {std::string("run.method = ") + method.name}});
  all.push_back({"half the time step", {fmt::format("run.dt_s = {}", 0.5 * frame.dt_s)}});
  all.push_back(
      {"half the restitution", {fmt::format("air.restitution = {}", 0.5 * frame.settings->restitution)}});
  const auto is_current = [&](const Offer& offer) { return offer.difference == current; };
  if (std::none_of(all.begin(), all.end(), is_current))
    all.push_back({fmt::format("{}", fmt::join(current, ", ")), current});
  return all;
}

}  // namespace

void SplitSection::edit(SettingRows& rows, const FrameView& frame, SplitSwitches& switches) {
  const std::string help =
      "X: the same launch twice with one clock, in two halves of the picture or over each other.\nBoth start "
      "anew, and what you change holds for both.";
  const int mode =
      rows.menu("Two at once (X)", help, "##split", kSplitViewNames, static_cast<int>(switches.mode));
  switches.mode = static_cast<SplitMode>(mode);
  const std::vector<Offer> all = offers(frame, switches.difference);
  std::vector<std::string> names;
  for (const Offer& offer : all) names.push_back(offer.name);
  const auto found = std::find_if(
      all.begin(), all.end(), [&](const Offer& offer) { return offer.difference == switches.difference; });
  const int chosen = rows.menu("Second half", "in what the second flight differs; M: its next method",
                               "##second", names, static_cast<int>(found - all.begin()));
  switches.difference = all[static_cast<std::size_t>(chosen)].difference;
  edit_setting(rows, switches);
}

// Any setting that may differ, typed.
void SplitSection::edit_setting(SettingRows& rows, SplitSwitches& switches) {
  const std::string help = fmt::format("section.key=value and Return, as air.restitution=0.5; one of\n{}",
                                       fmt::join(settings_that_may_differ(), "\n"));
  rows.begin_row("or a setting", help);
  const bool is_done = ImGui::InputTextWithHint("##setting", "key=value", typed_.data(), typed_.size(),
                                                ImGuiInputTextFlags_EnterReturnsTrue);
  rows.end_row("Second setting", help);
  if (is_done) {
    try {
      switches.difference = split_settings({typed_.data()});
      refusal_.clear();
    } catch (const UserError& error) {
      refusal_ = error.what();
    }
  }
  if (!refusal_.empty()) ImGui::TextWrapped("%s", refusal_.c_str());
}

}  // namespace pf
