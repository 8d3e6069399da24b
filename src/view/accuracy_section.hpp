// The panel's section on accuracy: what the run shows of itself, a slider that chooses method and step, and
// where the present setting stands between cost and error.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/accuracy.hpp"
#include "app/live_accuracy.hpp"
#include "view/look.hpp"
#include "view/setting_rows.hpp"

namespace pf {

class AccuracySection {
 public:
  // Describes the open section to ImGui. readout: null if nothing is followed yet. What the slider chooses
  // goes into rows' settings.
  void edit(SettingRows& rows, const FrameView& frame, const AccuracyReadout* readout, Theme theme);

 private:
  void load_table();
  void choose(SettingRows& rows, const FrameView& frame);
  void plot(SettingRows& rows, const FrameView& frame, Theme theme) const;
  std::string target(const Settings& settings) const;

  bool loaded_ = false;
  std::optional<nlohmann::json> table_;
  std::string note_;      // why there is no table, or what was chosen
  double percent_ = 2.0;  // on the slider
  int of_ = 0;            // 0: by the scene, else a place in accuracy_targets() plus 1
};

}  // namespace pf
