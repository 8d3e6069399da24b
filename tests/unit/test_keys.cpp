// The keys in words, as help and card show them, are those that the window acts on.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "app/key_table.hpp"
#include "view/window_input.hpp"

namespace pf {
namespace {

// The keys of a cell, as "space / S", "[ ] (or , .)" or "1-9".
std::set<std::string> keys_of(std::string cell) {
  std::erase_if(cell, [](char c) { return c == '(' || c == ')'; });
  std::set<std::string> keys;
  std::istringstream words(cell);
  for (std::string word; words >> word;) {
    if (word == "/" || word == "or") continue;
    if (word.size() == 3 && word[1] == '-') {
      for (char key = word[0]; key <= word[2]; ++key) keys.emplace(1, key);
    } else {
      keys.insert(word);
    }
  }
  return keys;
}

TEST(Keys, InWordsAreThoseOfTheWindow) {
  std::set<std::string> told;
  for (const KeyRow& row : kKeyRows) {
    for (const std::string& key : keys_of(row.keys))
      EXPECT_TRUE(told.insert(key).second) << key << " has two rows";
  }
  std::set<std::string> bound;
  for (const std::string& key : bound_keys())
    EXPECT_TRUE(bound.insert(key).second) << key << " is bound twice";
  EXPECT_EQ(bound.erase("="), 1U);  // a plus without Shift
  EXPECT_EQ(told, bound);
  EXPECT_GT(told.size(), 30U);
}

}  // namespace
}  // namespace pf
