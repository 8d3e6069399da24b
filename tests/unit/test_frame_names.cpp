// Names of single frames, and their use by --record.
#include "app/frame_names.hpp"

#include <gtest/gtest.h>

#include <string>

#include "app/options.hpp"
#include "core/error.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

std::filesystem::path recorded(const std::string& value) {
  const char* argv[] = {"pickleflight", "--record", value.c_str()};
  return parse_options(3, argv).options.value().record;
}

std::string refusal(const std::string& value) {
  try {
    recorded(value);
  } catch (const UserError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(FrameNames, RecognisesPatterns) {
  for (const char* name : {"%05d.png", "a/%d.png", "a/b-%09d-c.PNG", "a/%d.Png", "/%03d.png"}) {
    EXPECT_TRUE(is_frame_pattern(name)) << name;
  }
  for (const char* name : {"a.png", "%05d.mp4", "%5d.png", "%00d.png", "%0d.png", "%s.png", "%05d%05d.png",
                           "%.png", "%0", "", "a%d/%05d.png", "%05d"}) {
    EXPECT_FALSE(is_frame_pattern(name)) << name;
  }
}

TEST(FrameNames, InsertsNumbers) {
  EXPECT_EQ(frame_file("a/%05d.png", 0), "a/00000.png");
  EXPECT_EQ(frame_file("a/%05d.png", 123456), "a/123456.png");
  EXPECT_EQ(frame_file("x-%03d-y.png", 7), "x-007-y.png");
  EXPECT_EQ(frame_file("%d.png", 42), "42.png");
  EXPECT_EQ(frame_of("a/%05d.png", "b/00042.png"), 42);
  EXPECT_EQ(frame_of("x-%03d-y.png", "x-1234-y.png"), 1234);
  for (const char* other : {"42.png", "00042.jpg", "0004x.png", "99999999999.png", ".png", "-0042.png"})
    EXPECT_EQ(frame_of("%05d.png", other), std::nullopt) << other;
}

TEST(FrameNames, DerivesTheFramesFolderFromTheFilm) {
  EXPECT_EQ(frames_instead_of("out/flight.mp4"), "out/flight_frames/%05d.png");
  EXPECT_EQ(frames_instead_of("a.b.mkv"), "a.b_frames/%05d.png");
}

TEST(FrameNames, FramesInAFolderWithoutANameHaveALogAndAnotherFolder) {
  for (const char* folder : {"", "./", "../", "a/../"}) {
    const std::string film = std::string(folder) + "%05d.png";
    EXPECT_EQ(log_beside(film).lexically_normal(),
              std::filesystem::path(std::string(folder) + "frames.toml").lexically_normal());
    EXPECT_EQ(numbered(film, 2).lexically_normal(),
              std::filesystem::path(std::string(folder) + "frames-2/%05d.png").lexically_normal());
  }
  EXPECT_EQ(log_beside("./a/%05d.png"), "./a.toml");
}

TEST(FrameNames, RecordAcceptsAPatternInANewFolder) {
  TemporaryFolder folder;
  const std::string in_new = (folder.path() / "new" / "%05d.png").string();
  EXPECT_EQ(recorded(in_new), in_new);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "new")) << "reading the command line created a folder";
  EXPECT_EQ(recorded((folder.path() / "%05d.png").string()), folder.path() / "%05d.png");
  EXPECT_NE(refusal((folder.path() / "no" / "new" / "%05d.png").string()).find("does not exist"),
            std::string::npos);
  const std::string file = folder.write("file", "x").string();
  EXPECT_NE(refusal(file + "/%05d.png").find("cannot be written"), std::string::npos);
  EXPECT_NE(refusal("a.png").find("FOLDER/%05d.png"), std::string::npos) << refusal("a.png");
  EXPECT_NE(refusal("a.avi").find(".mp4 or .mkv"), std::string::npos);
}

TEST(FrameNames, AFreeNameIsTheFirstThatNoFileHas) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "gas.png";
  EXPECT_EQ(free_name(file), file);
  folder.write("gas.png", "");
  EXPECT_EQ(free_name(file).filename(), "gas-2.png");
  folder.write("gas-2.png", "");
  EXPECT_EQ(free_name(file).filename(), "gas-3.png");
  // No file system takes it: to write it fails, to ask for it must not.
  const std::filesystem::path too_long = folder.path() / (std::string(5000, 'a') + ".png");
  EXPECT_EQ(free_name(too_long), too_long);
}

}  // namespace
}  // namespace pf
