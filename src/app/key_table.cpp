#include "app/key_table.hpp"

#include <fmt/format.h>

namespace pf {

std::string key_help() {
  std::string text = "Mouse and keys in the window:\n";
  for (const KeyRow& row : kMouseRows) text += fmt::format("  {:<27}  {}\n", row.keys, row.does);
  for (const KeyRow& row : kKeyRows) text += fmt::format("  {:<27}  {}\n", row.keys, row.does);
  return text;
}

}  // namespace pf
