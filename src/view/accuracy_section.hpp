// The panel's section on accuracy: live figures of the run, a slider that chooses method and step, and a
// chart of error against cost with the current setting in it.
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
  // Describes the open section to ImGui. readout: null before the first figures. The slider's choice goes
  // into the settings of rows.
  void edit(SettingRows& rows, const FrameView& frame, const AccuracyReadout* readout, Theme theme);

 private:
  void load_table();
  void choose(SettingRows& rows, const FrameView& frame);
  void plot(SettingRows& rows, const FrameView& frame, Theme theme) const;
  std::string target(const Settings& settings) const;

  bool loaded_ = false;
  std::optional<nlohmann::json> table_;
  std::string note_;      // the reason why there is no table, or the choice made
  double percent_ = 2.0;  // on the slider
  int of_ = 0;            // 0: by the scene; else an index of accuracy_targets() plus 1
};

}  // namespace pf
