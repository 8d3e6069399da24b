// The folder of a study: what is continued, what is refused, what stays when it cannot be written.
#include "lab/study_files.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "core/error.hpp"
#include "lab/study.hpp"
#include "scene/scene_file.hpp"
#include "unit/temporary_folder.hpp"

namespace pf::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

void write(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

json whole_result() {
  return {{"study", "terms"},
          {"version", "1"},
          {"quick", true},
          {"machine", {{"devices", json::array()}, {"measured_under_load", false}}},
          {"points", json::array({{{"key", "court/vacuum"}}})}};
}

// Error of resume_study for this file; empty if it accepts it.
std::string refusal(const std::string& text) {
  const TemporaryFolder folder;
  write(folder.path() / "terms.json", text);
  json result = {{"version", "1"}, {"quick", true}, {"points", json::array()}};
  try {
    resume_study(folder.path(), terms_study(), result);
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

// Points of a CUDA device stay where there is none; whether they are all is known from the run that had one.
TEST(StudyFiles, ASeriesThatIsNotMeasuredNowIsAsCompleteAsItWas) {
  const auto others_are_complete = [](const char* command, json complete, const char* command_now) {
    const TemporaryFolder folder;
    json old = whole_result();
    old["command"] = command;
    old["complete"] = std::move(complete);
    write(folder.path() / "terms.json", old.dump());
    json result = {{"version", "1"}, {"quick", true}, {"points", json::array()}, {"command", command_now}};
    return resume_study(folder.path(), terms_study(), result);
  };
  EXPECT_FALSE(others_are_complete("lab terms --cuda", false, "lab terms"));
  EXPECT_FALSE(others_are_complete("lab terms --cuda", nullptr, "lab terms"));
  EXPECT_TRUE(others_are_complete("lab terms --cuda", true, "lab terms"));
  EXPECT_TRUE(others_are_complete("lab terms --cuda", false, "lab terms --cuda"));
  EXPECT_TRUE(others_are_complete("lab terms", false, "lab terms"));
}

TEST(StudyFiles, ADamagedResultIsRefusedByItsForm) {
  EXPECT_EQ(refusal(whole_result().dump()), "");
  for (const char* text : {"", "{", "[]", "null", R"({"study": 5})"})
    EXPECT_NE(refusal(text).find("damaged"), std::string::npos) << text;
  const json wrong[] = {{{"version", 3}},
                        {{"study", 5}},
                        {{"machine", 5}},
                        {{"machine", json::object()}},
                        {{"machine", {{"devices", json::array()}}}},
                        {{"points", "none"}},
                        {{"points", {3}}},
                        {{"points", {{{"key", 1}}}}}};
  for (const json& field : wrong) {
    json result = whole_result();
    result.update(field);
    EXPECT_NE(refusal(result.dump()).find("damaged"), std::string::npos) << result;
  }
}

TEST(StudyFiles, ARefusalSaysWhatWouldDo) {
  json full = whole_result(), old = whole_result();
  full["quick"] = false;
  old["version"] = "0";
  EXPECT_NE(refusal(full.dump()).find("leave it out"), std::string::npos) << refusal(full.dump());
  EXPECT_NE(refusal(old.dump()).find("version 0"), std::string::npos) << refusal(old.dump());
}

TEST(StudyFiles, AFolderThatCannotBeUsedIsRefusedBeforeWork) {
  const TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms::owner_read | fs::perms::owner_exec);
  if (::geteuid() != 0) {
    EXPECT_THROW(open_results(folder.path(), Existing::refuse), UserError);
    EXPECT_THROW(open_results(folder.path(), Existing::overwrite), UserError);
  }
  fs::permissions(folder.path(), fs::perms::owner_all);
  EXPECT_NO_THROW(open_results(folder.path(), Existing::refuse));
}

TEST(StudyFiles, OnlyAFolderOfStudiesIsContinued) {
  const TemporaryFolder folder;
  EXPECT_NO_THROW(open_results(folder.path(), Existing::resume)) << "empty";
  write(folder.path() / "report.html", "of somebody else");
  write(folder.path() / "list.json", "[1]");
  EXPECT_THROW(open_results(folder.path(), Existing::resume), UserError);
  EXPECT_NO_THROW(open_results(folder.path(), Existing::overwrite));
  save_study(folder.path(), whole_result());
  EXPECT_NO_THROW(open_results(folder.path(), Existing::resume));
}

TEST(StudyFiles, AFailedWriteLeavesTheOldFilesAndNothingElse) {
  const TemporaryFolder folder;
  json result = whole_result();
  save_study(folder.path(), result);
  const std::string before = text_of(folder.path() / "terms.json");
  // /dev/full stands for the full disk.
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  fs::create_symlink("/dev/full", folder.path() / "terms.json.part");
  result["quick"] = false;
  EXPECT_THROW(save_study(folder.path(), result), UserError);
  EXPECT_EQ(text_of(folder.path() / "terms.json"), before);
  EXPECT_FALSE(fs::exists(fs::symlink_status(folder.path() / "terms.json.part")));
  EXPECT_NO_THROW(save_study(folder.path(), result));
}

TEST(StudyFiles, AResultReplacesTheTargetOfALink) {
  const TemporaryFolder folder;
  fs::create_directory(folder.path() / "kept");
  write(folder.path() / "kept" / "result.json", "an earlier result");
  fs::create_symlink("kept/result.json", folder.path() / "terms.json");
  save_study(folder.path(), whole_result());
  EXPECT_TRUE(fs::is_symlink(folder.path() / "terms.json"));
  EXPECT_EQ(text_of(folder.path() / "kept" / "result.json"), text_of(folder.path() / "terms.json"));
  EXPECT_NE(text_of(folder.path() / "terms.json"), "an earlier result");
}

// Two links on the way, one of them in another folder.
TEST(StudyFiles, AResultIsMadeWhereALinkLeads) {
  const TemporaryFolder folder;
  fs::create_directory(folder.path() / "kept");
  fs::create_symlink("kept/latest.json", folder.path() / "terms.json");
  fs::create_symlink("result.json", folder.path() / "kept" / "latest.json");
  save_study(folder.path(), whole_result());
  EXPECT_TRUE(fs::is_symlink(folder.path() / "terms.json"));
  EXPECT_TRUE(fs::is_symlink(folder.path() / "kept" / "latest.json"));
  EXPECT_EQ(json::parse(text_of(folder.path() / "kept" / "result.json")), whole_result());
}

TEST(StudyFiles, ANameThatIsNotUtf8DoesNotStopAResult) {
  const TemporaryFolder folder;
  json result = whole_result();
  result["machine"]["devices"] = {{{"series", "cpu"}, {"device", "a \xFF b"}}};
  save_study(folder.path(), result);
  EXPECT_EQ(json::parse(text_of(folder.path() / "terms.json"))["machine"]["devices"][0]["device"],
            "a \uFFFD b");
}

TEST(StudyFiles, LinksInARingAreReplaced) {
  const TemporaryFolder folder;
  fs::create_symlink("other.json", folder.path() / "terms.json");
  fs::create_symlink("terms.json", folder.path() / "other.json");
  save_study(folder.path(), whole_result());
  EXPECT_EQ(json::parse(text_of(folder.path() / "terms.json")), whole_result());
}

TEST(StudyFiles, OldPicturesOfAStudyGoAndOthersStay) {
  const TemporaryFolder folder;
  for (const char* name :
       {"terms.png", "terms.svg", "terms-more.png", "terms.csv", "stability.png", "termsx.png"})
    write(folder.path() / name, "x");
  remove_pictures(folder.path(), "terms");
  for (const char* name : {"terms.png", "terms.svg", "terms-more.png"})
    EXPECT_FALSE(fs::exists(folder.path() / name)) << name;
  for (const char* name : {"terms.csv", "stability.png", "termsx.png"})
    EXPECT_TRUE(fs::exists(folder.path() / name)) << name;
}

json table(const char* version, bool quick, int mark) {
  return {{"study", "work-precision"},
          {"version", version},
          {"quick", quick},
          {"points", json::array()},
          {"mark", mark}};
}

TEST(StudyFiles, AQuickTableIsNotKept) {
  const TemporaryFolder folder;
  const fs::path kept = folder.path() / "cache/pickleflight/work-precision.json";
  const auto note_after = [&](const json& measured) {
    save_study(folder.path(), measured);
    return keep_accuracy_table(folder.path(), kept);
  };
  EXPECT_NE(note_after(table("1", true, 1)), "");
  EXPECT_FALSE(fs::exists(kept)) << "the one that the program comes with is better";
  EXPECT_EQ(note_after(table("1", false, 2)), "") << "in a new folder";
  EXPECT_NE(note_after(table("2", true, 3)), "");
  EXPECT_EQ(json::parse(text_of(kept)).at("mark"), 2);
  EXPECT_EQ(note_after(table("2", false, 4)), "");
  EXPECT_EQ(json::parse(text_of(kept)).at("mark"), 4);
  EXPECT_EQ(keep_accuracy_table(folder.path(), {}), "") << "no folder for it";
}

TEST(StudyFiles, ATableThatCannotBeWrittenLeavesTheOldOne) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const TemporaryFolder folder;
  const fs::path kept = folder.path() / "kept.json";
  write(kept, "old");
  save_study(folder.path(), table("1", false, 1));
  fs::create_symlink("/dev/full", folder.path() / "kept.json.part");
  EXPECT_NE(keep_accuracy_table(folder.path(), kept).find("cannot be written"), std::string::npos);
  EXPECT_EQ(text_of(kept), "old");
}

// Numbers may differ in their last digits, by compiler and machine.
void expect_same(const json& now, const json& shipped, const std::string& where) {
  ASSERT_EQ(now.type() == json::value_t::number_float, shipped.type() == json::value_t::number_float)
      << where;
  ASSERT_EQ(now.size(), shipped.size()) << where;
  if (now.is_number_float()) {
    const auto expected = shipped.get<double>();
    EXPECT_NEAR(now.get<double>(), expected, 1e-9 * std::fabs(expected) + 1e-15) << where;
  } else if (now.is_structured()) {
    for (const auto& [key, value] : shipped.items())
      expect_same(now.is_array() ? now.at(std::stoul(key)) : now.at(key), value, where + "/" + key);
  } else {
    EXPECT_EQ(now, shipped) << where;
  }
}

// The files that come with the program say what it says of the same points today.
TEST(StudyFiles, ShippedConclusionsAreThoseOfTheProgram) {
  const fs::path folder = find_asset(fs::path("lab") / "work-precision.json").parent_path();
  for (const Study& study : studies()) {
    const fs::path file = folder / (study.name + ".json");
    if (!fs::exists(file)) continue;
    const json shipped = json::parse(text_of(file));
    json result = shipped;
    study.conclude(result);
    expect_same(result, shipped, study.name);
  }
}

}  // namespace
}  // namespace pf::test
