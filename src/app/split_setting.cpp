#include "app/split_setting.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "app/input_log.hpp"
#include "core/error.hpp"
#include "core/text.hpp"
#include "model/methods.hpp"
#include "scene/derive.hpp"

namespace pf {
namespace {

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t") + 1 - begin);
}

std::string path_of(const std::string& edit) {
  return edit == kNextMethod ? "run.method" : edit.substr(0, edit.find(" = "));
}

// The key alone is enough for a setting that may differ.
std::string full_path(const std::string& name) {
  for (const std::string& path : settings_that_may_differ()) {
    if (path == name || path.substr(path.find('.') + 1) == name) return path;
  }
  const std::string found = find_field(name, "--split").path();
  throw UserError(
      fmt::format("--split: {} cannot differ, since both halves have the same parcels at the start, launch "
                  "and clock; one of {}",
                  found, fmt::join(settings_that_may_differ(), ", ")));
}

std::string method_edit(Method method) { return std::string("run.method = ") + method_name(method); }

void put(Difference& difference, const std::string& edit) {
  std::erase_if(difference, [&](const std::string& old) { return path_of(old) == path_of(edit); });
  difference.push_back(edit);
}

// Throws UserError if the settings cannot run.
void check_second(const Settings& second) {
  try {
    const Physics physics = derive_physics(second);
    const Spawner tried(second, physics, initial_ball(second));
  } catch (const UserError& error) {
    throw UserError(fmt::format("--split: the second half cannot fly: {}", error.what()));
  }
}

// value: its text.
std::string name_of(const Field& field, const Settings& settings, const std::string& value) {
  const std::string path = field.path();
  if (path == "run.method") return value;
  if (path == "run.dt_s" && settings.dt_s == 0.0) return "automatic step";
  if (path == "run.dt_s") return fmt::format("step {} s", value);
  return fmt::format("{} {}{}{}", field.key, value, field.unit.empty() ? "" : " ", field.unit);
}

// The values of both in a field, with few digits where these tell them apart.
SplitNames names_of(const Field& field, const Settings& first, const Settings& second) {
  const auto both = [&](auto text_of) {
    return SplitNames{name_of(field, first, text_of(field, first)),
                      name_of(field, second, text_of(field, second))};
  };
  const SplitNames names = both(short_value_text);
  if (names.first != names.second) return names;
  return both([](const Field& of, const Settings& settings) { return value_text(of, settings); });
}

}  // namespace

const std::vector<std::string>& settings_that_may_differ() {
  static const std::vector<std::string> paths = {
      "run.method",         "run.dt_s",          "air.restitution",     "run.displacement_per_step",
      "run.substeps",       "run.max_substeps",  "run.neighbors",       "run.spring_contact_s",
      "run.allow_unstable", "run.contact_clock", "run.contact_clock_s", "air.contacts",
      "air.impulse_scale",  "ball.friction",     "ball.magnus",         "ball.k_magnus",
      "ball.mass_kg",       "ball.inertia"};
  return paths;
}

std::string split_setting(const std::string& assignment) {
  if (trimmed(assignment) == kNextMethod) return kNextMethod;
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos) {
    throw UserError(
        fmt::format("--split: {} has no '='; give section.key=value, as run.method=spring, or "
                    "nothing for the next method",
                    in_quotes(assignment)));
  }
  const std::string path = full_path(trimmed(assignment.substr(0, equals)));
  Settings scratch;
  const Field& field = find_field(path, "--split");
  set_from_text(field, scratch, trimmed(assignment.substr(equals + 1)), "--split " + path);
  return edit_text(field, scratch);
}

Difference split_settings(const std::vector<std::string>& assignments) {
  Difference difference;
  for (const std::string& assignment : assignments) {
    const std::string edit = split_setting(assignment);
    const auto is_same = [&](const std::string& old) { return path_of(old) == path_of(edit); };
    if (std::any_of(difference.begin(), difference.end(), is_same))
      throw UserError(fmt::format("--split: {} is given twice; give it once", path_of(edit)));
    difference.push_back(edit);
  }
  if (difference.empty()) difference.emplace_back(kNextMethod);
  return difference;
}

Settings differing(Settings first, const Difference& difference) {
  apply_edits(difference, first, "--split");
  return first;
}

Difference resolved(const Difference& difference, const Settings& first) {
  const auto next = std::find(difference.begin(), difference.end(), kNextMethod);
  if (next == difference.end()) {
    check_second(differing(first, difference));
    return difference;
  }
  const auto at = static_cast<std::size_t>(next - difference.begin());
  std::string reason;
  for (const Method method : methods_after(first.method)) {
    Difference tried = difference;
    tried[at] = method_edit(method);
    try {
      check_second(differing(first, tried));
      return tried;
    } catch (const UserError& error) {
      reason = error.what();
    }
  }
  throw UserError(reason);
}

Difference compared(const Difference& difference, Comparison comparison, const Settings& first, double dt_s) {
  Difference changed = difference;
  const Settings second = differing(first, difference);
  const auto is_step = [](const std::string& edit) { return path_of(edit) == "run.dt_s"; };
  if (comparison == Comparison::next_method) {
    const auto others = methods_after(second.method);
    put(changed, method_edit(others[0] == first.method ? others[1] : others[0]));
  } else if (std::any_of(changed.begin(), changed.end(), is_step)) {
    std::erase_if(changed, is_step);
    if (changed.empty()) changed.push_back(method_edit(second.method));
  } else {
    put(changed, fmt::format("run.dt_s = {}", 0.5 * dt_s));
  }
  return changed;
}

SplitNames split_names(const Settings& first, const Difference& difference) {
  const Settings second = differing(first, difference);
  SplitNames names;
  const auto add = [](std::string& to, const std::string& what) { to += (to.empty() ? "" : ", ") + what; };
  for (const std::string& edit : difference) {
    const SplitNames both = names_of(find_field(path_of(edit), "--split"), first, second);
    add(names.first, both.first);
    add(names.second, both.second);
  }
  return names;
}

std::vector<std::string> with_split_values(std::vector<std::string> arguments) {
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] != "--split") continue;
    const bool has_value =
        i + 1 < arguments.size() && !arguments[i + 1].starts_with('-') &&
        (arguments[i + 1].find('=') != std::string::npos || arguments[i + 1] == kNextMethod);
    if (has_value) {
      arguments[i] += "=" + arguments[i + 1];
      arguments.erase(arguments.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    } else {
      arguments[i] += std::string("=") + kNextMethod;
    }
  }
  return arguments;
}

}  // namespace pf
