// The choice of two methods at once, in the panel or by key.
#pragma once

#include <cstdint>

#include "app/split_setting.hpp"

namespace pf {

// In the order of kSplitViewNames (app/options.hpp).
enum class SplitMode : std::uint8_t { off, halves, picture };

struct SplitSwitches {
  SplitMode mode = SplitMode::off;
  Difference difference = {kNextMethod};
};

}  // namespace pf
