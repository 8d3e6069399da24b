// The settings in which the second of two flights differs from the first: "section.key = value", as in a log.
#pragma once

#include <string>
#include <vector>

#include "app/simulation.hpp"
#include "scene/settings.hpp"

namespace pf {

using Difference = std::vector<std::string>;

// Stands for a method that is chosen at the start: the next one that can fly the settings.
constexpr const char* kNextMethod = "next";

// Settings that the halves may differ in. Both have the same parcels at the start, launch, and clock.
const std::vector<std::string>& settings_that_may_differ();

// "run.method=spring", "method = spring" or "next" in the form above; "next" stays. Throws UserError if the
// setting is unknown, cannot differ, or does not take the value.
std::string split_setting(const std::string& assignment);
// The same for each. Empty: the next method. Throws UserError as above, and if a setting is given twice.
Difference split_settings(const std::vector<std::string>& assignments);

// The settings of the second flight beside one with `first`. difference: without "next".
Settings differing(Settings first, const Difference& difference);

// Replaces "next" by the method that it means. Throws UserError, with the reason, if settings of the second
// flight cannot run beside the first.
Difference resolved(const Difference& difference, const Settings& first);

// Returns the settings in which the second flight differs from the `first`: the next method, half of its time
// step, or the scene's step again. dt_s: its step now.
Difference compared(const Difference& difference, Comparison comparison, const Settings& first, double dt_s);

// The names of both flights: the values in which they differ, as "impulse" and "spring".
struct SplitNames {
  std::string first, second;
};
SplitNames split_names(const Settings& first, const Difference& difference);

// An option --split without a value gets one: "next".
std::vector<std::string> with_split_values(std::vector<std::string> arguments);

}  // namespace pf
