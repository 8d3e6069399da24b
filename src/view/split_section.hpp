// The panel's section of two methods at once.
#pragma once

#include <array>
#include <string>

#include "app/simulation.hpp"
#include "view/setting_rows.hpp"
#include "view/split_switches.hpp"

namespace pf {

class SplitSection {
 public:
  void edit(SettingRows& rows, const FrameView& frame, SplitSwitches& switches);

 private:
  void edit_setting(SettingRows& rows, SplitSwitches& switches);

  std::array<char, 96> typed_{};
  std::string refusal_;
};

}  // namespace pf
