// The program's name and the menu of scenes, at the top of the panel.
#pragma once

#include <string>
#include <vector>

#include "app/simulation.hpp"
#include "view/setting_rows.hpp"

namespace pf {

// A scene as the menu shows it.
struct SceneText {
  std::string name, description;  // why it cannot be read, if so
};

class SceneMenu {
 public:
  // The choice goes into Commands::scene. Choosing the current scene loads it again.
  void edit(SettingRows& rows, const FrameView& frame, Commands& commands);

 private:
  std::vector<SceneText> scenes_;  // listed when the menu opened
};

}  // namespace pf
