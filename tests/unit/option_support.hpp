// Helpers for tests of the command line.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "app/options.hpp"
#include "core/error.hpp"
#include "support/text.hpp"

namespace pf {

inline ParseResult parse(const std::vector<std::string>& arguments) {
  std::vector<const char*> argv = {"pickleflight"};
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  return parse_options(static_cast<int>(argv.size()), argv.data());
}

inline Options options_of(const std::vector<std::string>& arguments) {
  return parse(arguments).options.value();
}

inline std::string refusal(const std::vector<std::string>& arguments) {
  try {
    parse(arguments);
  } catch (const UserError& error) {
    EXPECT_FALSE(contains(error.what(), "\n")) << error.what();
    return error.what();
  }
  return "accepted";
}

}  // namespace pf
