// Settings that the command line gives, and checks that each option has an effect beside the others.
#pragma once

#include "app/option_flags.hpp"

namespace pf {

// A setting on the command line: its path, and the option that gives it, as a user would leave it out.
struct GivenSetting {
  std::string path, option;
};
std::vector<GivenSetting> given_settings(const Typed& typed);
bool gives(const Typed& typed, const std::string& path);

// Throws UserError if an option of `run` or `bench` has no effect.
void check_effects(const CLI::App& command, const Typed& typed, const Options& options);

}  // namespace pf
