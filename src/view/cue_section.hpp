// The panel's section of cues: the list with the current one marked, and fields to load and to add.
#pragma once

#include <array>
#include <string>

#include "app/cue_player.hpp"
#include "view/setting_rows.hpp"

namespace pf {

// A request of the user in the section, which the stage carries out.
struct CueRequest {
  int go_to = CuePlayer::kNone;
  std::string load;     // this file; empty: none
  std::string save_to;  // appends the present state to this file; empty: none
  std::string title;    // of the state to save
};

class CueSection {
 public:
  void edit(SettingRows& rows, const CuePlayer& cues, CueRequest& request);

 private:
  void list(SettingRows& rows, const CuePlayer& cues, CueRequest& request);
  void file_rows(SettingRows& rows, CueRequest& request);

  std::array<char, 256> file_{};
  std::array<char, 128> title_{};
  std::string shown_file_;  // of the list that the field was filled with
};

}  // namespace pf
