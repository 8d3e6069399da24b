// Conversion of settings to and from text.
#include "scene/settings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <string_view>

#include "core/error.hpp"
#include "core/text.hpp"

namespace pf {
namespace {

template <class... Ts>
struct Overload : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overload(Ts...) -> Overload<Ts...>;

// False if the caller narrowed the range (as -p does) and the default lies outside.
bool is_allowed_default(const Field& field) {
  const auto* member = std::get_if<std::int64_t Settings::*>(&field.member);
  return member == nullptr || static_cast<double>(Settings{}.**member) >= field.min;
}

// Allowed values of a field with unit and default, for the end of every message.
std::string allowed_text(const Field& field) {
  const std::string unit = field.unit.empty() ? "" : " " + field.unit;
  const std::string range = fmt::format("from {}{}", range_text(field), unit);
  const std::string kind = std::visit(
      Overload{
          [&](double Settings::*) { return "a number " + range; },
          [&](std::int64_t Settings::*) { return "a whole number " + range; },
          [](bool Settings::*) { return std::string("true or false"); },
          [&](std::string Settings::*) { return fmt::format("text of at most {} bytes", field.max); },
          [](const Choice& choice) { return fmt::format("one of {}", fmt::join(choice.names, ", ")); },
      },
      field.member);
  const std::string standard = value_text(field, Settings{});
  const std::string text = fmt::format("{} takes {}", field.path(), kind);
  return standard.empty() || !is_allowed_default(field) ? text
                                                        : fmt::format("{} (default {})", text, standard);
}

[[noreturn]] void refuse(const Field& field, const std::string& text, const std::string& where,
                         const std::string& reason) {
  throw UserError(fmt::format("{}: {} {}; {}", where, in_quotes(text), reason, allowed_text(field)));
}

enum class Reading { good, malformed, too_large };

// Reads all of text as a number. A leading '+' is allowed.
template <class T>
Reading read_number(const std::string& text, T& value) {
  const char* first = text.data();
  const char* last = first + text.size();
  if (text.size() > 1 && *first == '+' && first[1] != '-') ++first;
  const auto [end, error] = std::from_chars(first, last, value);
  if (error == std::errc::result_out_of_range && end == last) return Reading::too_large;
  return error == std::errc() && end == last ? Reading::good : Reading::malformed;
}

void check_number(const Field& field, double value, const std::string& text, const std::string& where) {
  if (!std::isfinite(value)) refuse(field, text, where, "is not a finite number");
  if (value < field.min || value > field.max) refuse(field, text, where, "is out of range");
}

double double_from(const Field& field, const std::string& text, const std::string& where) {
  double value = 0.0;
  const Reading reading = read_number(text, value);
  if (reading == Reading::malformed) refuse(field, text, where, "is not a number");
  if (reading == Reading::too_large) refuse(field, text, where, "is out of range");
  check_number(field, value, text, where);
  return value;
}

// The digits of a whole number: "9007199254740993" of "+9007199254740993.0". Empty if it has another form.
std::string_view whole_digits(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const std::size_t end = std::min(text.find_first_not_of("0123456789"), text.size());
  const std::string_view rest = text.substr(end);
  const bool is_whole = rest.empty() || (rest[0] == '.' && rest.find_first_not_of('0', 1) == rest.npos);
  return is_whole ? text.substr(0, end) : std::string_view();
}

// Accepts 1e6 as a whole number, too. Ranges of whole numbers end at 2^53, so that a double holds them. A
// number above that must not be rounded into the range: 2^53 itself is what 2^53 + 1 would be rounded to, and
// is accepted only as its own digits.
std::int64_t integer_from(const Field& field, const std::string& text, const std::string& where) {
  const double value = double_from(field, text, where);
  if (value != std::floor(value)) refuse(field, text, where, "is not a whole number");
  if (value == kMaxExactInteger) {
    std::int64_t exact = 0;
    const std::string_view digits = whole_digits(text);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), exact);
    if (error != std::errc() || exact != static_cast<std::int64_t>(value))
      refuse(field, text, where, "is out of range");
  }
  return static_cast<std::int64_t>(value);
}

bool bool_from(const Field& field, const std::string& text, const std::string& where) {
  if (text == "true" || text == "on") return true;
  if (text == "false" || text == "off") return false;
  refuse(field, text, where, "is neither true nor false");
}

int choice_from(const Field& field, const Choice& choice, const std::string& text, const std::string& where) {
  const auto found = std::find(choice.names.begin(), choice.names.end(), text);
  if (found != choice.names.end()) return static_cast<int>(found - choice.names.begin());
  refuse(field, text, where, "is unknown" + say_nearest(", the nearest is ", text, choice.names));
}

// Levenshtein distance, ignoring case.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row[b.size()];
}

}  // namespace

std::string limit_text(double limit) {
  if (limit == kMaxExactInteger) return "2^53";
  for (const auto& [unit, name] : {std::pair(1e9, "billion"), std::pair(1e6, "million")}) {
    const double number = limit / unit;
    if (std::abs(number) >= 1.0 && number == std::round(number)) return fmt::format("{} {}", number, name);
  }
  return fmt::format("{}", limit);
}

std::string range_text(const Field& field) {
  return fmt::format("{} to {}", limit_text(field.min), limit_text(field.max));
}

std::string value_text(const Field& field, const Settings& settings) {
  return std::visit(
      Overload{
          [&](double Settings::*member) { return fmt::format("{}", settings.*member); },
          [&](std::int64_t Settings::*member) { return fmt::format("{}", settings.*member); },
          [&](bool Settings::*member) { return std::string(settings.*member ? "true" : "false"); },
          [&](std::string Settings::*member) { return settings.*member; },
          [&](const Choice& choice) {
            return choice.names.at(static_cast<std::size_t>(choice.get(settings)));
          },
      },
      field.member);
}

std::string value_text(const std::string& path, const Settings& settings) {
  return value_text(find_field(path, "settings"), settings);
}

std::string short_value_text(const Field& field, const Settings& settings) {
  if (const auto* number = std::get_if<double Settings::*>(&field.member))
    return fmt::format("{:.5g}", settings.**number);
  return value_text(field, settings);
}

bool is_same(const Field& field, const Settings& a, const Settings& b) {
  return std::visit(Overload{
                        [&](auto Settings::*member) { return a.*member == b.*member; },
                        [&](const Choice& choice) { return choice.get(a) == choice.get(b); },
                    },
                    field.member);
}

void copy_field(const Field& field, const Settings& from, Settings& to) {
  std::visit(Overload{
                 [&](auto Settings::*member) { to.*member = from.*member; },
                 [&](const Choice& choice) { choice.set(to, choice.get(from)); },
             },
             field.member);
}

bool differ(const Settings& a, const Settings& b, bool Effects::*effect) {
  const auto differs = [&](const Field& field) { return field.effects.*effect && !is_same(field, a, b); };
  return std::any_of(fields().begin(), fields().end(), differs);
}

Settings only(const Settings& settings, bool Effects::*effect) {
  Settings part;
  for (const Field& field : fields()) {
    if (field.effects.*effect) copy_field(field, settings, part);
  }
  return part;
}

void set_from_text(const Field& field, Settings& settings, const std::string& text,
                   const std::string& where) {
  std::visit(Overload{
                 [&](double Settings::*member) { settings.*member = double_from(field, text, where); },
                 [&](std::int64_t Settings::*member) { settings.*member = integer_from(field, text, where); },
                 [&](bool Settings::*member) { settings.*member = bool_from(field, text, where); },
                 [&](std::string Settings::*member) {
                   if (static_cast<double>(text.size()) > field.max)
                     refuse(field, text, where, "is too long");
                   if (!is_utf8(text)) refuse(field, text, where, "is not UTF-8");
                   settings.*member = text;
                 },
                 [&](const Choice& choice) { choice.set(settings, choice_from(field, choice, text, where)); },
             },
             field.member);
}

void check_settings(const Settings& settings, const std::string& where) {
  for (const Field& field : fields()) {
    const auto check = [&](double value) { check_number(field, value, value_text(field, settings), where); };
    if (const auto* number = std::get_if<double Settings::*>(&field.member)) check(settings.**number);
    if (const auto* whole = std::get_if<std::int64_t Settings::*>(&field.member))
      check(static_cast<double>(settings.**whole));
  }
}

namespace {

// The field of exactly this path, or null. It allocates nothing: the panel calls it dozens of times a frame.
const Field* exact_field(std::string_view path) {
  for (const Field& field : fields()) {
    const std::size_t dot = field.section.size();
    if (path.size() == dot + 1 + field.key.size() && path[dot] == '.' && path.starts_with(field.section) &&
        path.ends_with(field.key))
      return &field;
  }
  return nullptr;
}

}  // namespace

const Field& find_field(std::string_view path, std::string_view where) {
  if (const Field* found = exact_field(path)) return *found;
  std::vector<std::string> paths;
  const Field* same_key = nullptr;  // for a key with a missing or wrong section
  const std::string_view key = path.substr(path.find('.') == std::string_view::npos ? 0 : path.find('.') + 1);
  for (const Field& field : fields()) {
    if (field.key == key) same_key = &field;
    paths.push_back(field.path());
  }
  const std::string name(path), nearest = same_key ? same_key->path() : nearest_name(name, paths);
  throw UserError(fmt::format("{}: {} is not a setting{}{} (all: pickleflight --help)", where,
                              in_quotes(name), nearest.empty() ? "" : "; the nearest is ", nearest));
}

std::string nearest_name(const std::string& name, const std::vector<std::string>& names) {
  const std::string tried = name.substr(0, 200);  // bounds the cost of the distance
  const std::string& nearest =
      *std::min_element(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
        return edit_distance(tried, a) < edit_distance(tried, b);
      });
  const std::size_t wrong = edit_distance(tried, nearest), length = std::max(tried.size(), nearest.size());
  return wrong <= 2 || 5 * wrong <= 2 * length ? nearest : "";
}

std::string say_nearest(std::string_view before, const std::string& name,
                        const std::vector<std::string>& names, std::string_view after) {
  const std::string nearest = nearest_name(name, names);
  return nearest.empty() ? "" : fmt::format("{}{}{}", before, nearest, after);
}

}  // namespace pf
