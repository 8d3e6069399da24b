// Files dropped on the window: what they are, and what becomes of them.
#include "app/dropped_file.hpp"

#include <gtest/gtest.h>

#include "support/logged_flight.hpp"
#include "support/text.hpp"
#include "temporary_folder.hpp"

namespace pf::test {
namespace {

TEST(DroppedFile, AScene) {
  TemporaryFolder folder;
  const auto scene = folder.write("a scene.toml", "[scene]\nname = \"mini\"\n[air]\nrestitution = 0.5\n");
  EXPECT_EQ(kind_of_dropped(scene), DroppedKind::scene);
  EXPECT_EQ(answer_drop({scene}).scene, scene.string());
  EXPECT_EQ(answer_drop({scene}).line, "");
  // Loading it says what is wrong, and where.
  EXPECT_EQ(kind_of_dropped(folder.write("broken.toml", "[scene\n")), DroppedKind::scene);
}

TEST(DroppedFile, ALogNamesTheCommandToType) {
  TemporaryFolder folder;
  const auto plain = folder.path() / "flight.toml";
  const auto spaced = folder.path() / "my flight's.toml";
  fly_logged(plain, 0, make_cpu_backend(1));
  std::filesystem::copy_file(plain, spaced);
  EXPECT_EQ(kind_of_dropped(plain), DroppedKind::log);
  EXPECT_EQ(answer_drop({plain}).scene, "");
  EXPECT_TRUE(contains(answer_drop({plain}).line, "type: pickleflight run " + plain.string()));
  EXPECT_TRUE(
      contains(answer_drop({spaced}).line, "run '" + (folder.path() / "my flight'\\''s.toml").string() + "'"))
      << answer_drop({spaced}).line;
}

TEST(DroppedFile, ACueListIsLoaded) {
  TemporaryFolder folder;
  for (const char* text :
       {"[[cue]]\ntitle = \"A\"\n", "[[cue]]\ntitle = \n"}) {  // loading says what is wrong
    const auto list = folder.write("talk.toml", text);
    EXPECT_EQ(kind_of_dropped(list), DroppedKind::cues) << text;
    EXPECT_EQ(answer_drop({list}).cues, list.string());
    EXPECT_EQ(answer_drop({list}).scene, "");
    EXPECT_EQ(answer_drop({list}).line, "");
  }
}

TEST(DroppedFile, AnythingElseIsRefusedInOneLine) {
  TemporaryFolder folder;
  const std::vector<std::filesystem::path> others = {folder.path(), folder.path() / "absent.toml",
                                                     folder.write("picture.png", "\x89PNG\r\n"),
                                                     folder.write("notes.txt", "a = 1\n")};
  for (const auto& file : others) {
    EXPECT_EQ(kind_of_dropped(file), DroppedKind::other) << file;
    const DropAnswer answer = answer_drop({file});
    EXPECT_EQ(answer.scene, "") << file;
    EXPECT_TRUE(contains(answer.line, "a scene or a cue list can, NAME.toml")) << answer.line;
    EXPECT_FALSE(contains(answer.line, "\n"));
  }
  EXPECT_TRUE(contains(answer_drop({others[2], others[3]}).line, "one file at a time"));
  EXPECT_TRUE(contains(answer_drop({}).line, "one file at a time"));
}

}  // namespace
}  // namespace pf::test
