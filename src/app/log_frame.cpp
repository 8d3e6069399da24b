// Parts of a log's frame: edits of settings, switches, and what belongs to a second flight.
#include <fmt/format.h>

#include <cstdint>

#include "app/input_log.hpp"
#include "app/split_setting.hpp"
#include "core/error.hpp"
#include "core/text.hpp"
#include "scene/scene_file.hpp"

namespace pf {

std::string edit_text(const Field& field, const Settings& settings) {
  return field.path() + " = " + value_text(field, settings);
}

void apply_edits(const std::vector<std::string>& edits, Settings& settings, const std::string& where) {
  for (const std::string& edit : edits) {
    const std::size_t equals = edit.find(" = ");
    if (equals == std::string::npos) {
      throw UserError(fmt::format("{}: {} is not a setting with its value; give section.key = value", where,
                                  in_quotes(edit)));
    }
    set_from_text(find_field(edit.substr(0, equals), where), settings, edit.substr(equals + 3), where);
  }
}

std::vector<CommandSwitch> command_switches() {
  return {{"toggle_pause", &Commands::toggle_pause},
          {"single_step", &Commands::single_step},
          {"reset", &Commands::reset},
          {"launch", &Commands::launch},
          {"hold", &Commands::hold},
          {"back", &Commands::back}};
}

std::string second_text(const SecondInFrame& second) {
  std::string text;
  if (second.split) {
    text = "split = [";
    for (const std::string& edit : *second.split)
      text += (&edit == second.split->data() ? "" : ", ") + toml_string(edit);
    text += "]\n";
  }
  if (second.max_steps) text += fmt::format("second_max_steps = {}\n", *second.max_steps);
  if (!second.hash.empty()) text += fmt::format("second_hash = {}\n", toml_string(second.hash));
  return text;
}

void check_split(const std::vector<std::string>& split, const std::string& where) {
  try {
    for (const std::string& edit : split) split_setting(edit);
  } catch (const UserError& error) {
    throw UserError(fmt::format("{}: {}", where, error.what()));
  }
}

}  // namespace pf
