// Scene files: reading, errors, writing, and the shipped scenes.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "core/error.hpp"
#include "scene/scene_file.hpp"
#include "support/full_disk.hpp"
#include "support/text.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

template <class Call>
std::string message_of(Call call) {
  try {
    call();
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

class SceneFile : public testing::Test {
 protected:
  Settings load(const std::string& text) { return load_scene_file(folder_.write("s.toml", text)); }
  // The error for a file with this text, without the name of its folder.
  std::string refusal(const std::string& text) {
    const std::string message = message_of([&] { load(text); });
    const std::size_t at = message.find("s.toml");
    return at == std::string::npos ? message : message.substr(at);
  }

  TemporaryFolder folder_;
};

// Sets PICKLEFLIGHT_ASSETS during the lifetime of the object.
class AssetsVariable {
 public:
  explicit AssetsVariable(const std::filesystem::path& folder) {
    ::setenv("PICKLEFLIGHT_ASSETS", folder.c_str(), 1);
  }
  ~AssetsVariable() { ::unsetenv("PICKLEFLIGHT_ASSETS"); }
};

TEST_F(SceneFile, ReadsValuesOverTheBase) {
  const auto file = folder_.write("mine.toml",
                                  "[air]\nkind = \"drag\"\nnum_parcels = 1_000\nrestitution = 1\n"
                                  "[ball]\nheld = true\nvx_mps = -2.5\n[run]\nmethod = \"spring\"\n");
  Settings base;
  base.ball_mass_kg = 3.0;
  const Settings read = load_scene_file(file, base);
  Settings expected = base;
  expected.name = "mine";
  expected.air = Air::drag;
  expected.num_parcels = 1000;
  expected.restitution = 1.0;
  expected.ball_held = true;
  expected.ball_vx_mps = -2.5;
  expected.method = Method::spring;
  EXPECT_EQ(read, expected);
}

TEST_F(SceneFile, ReadsNameAndDescription) {
  const Settings read = load("[scene]\nname = \"drive\"\ndescription = \"x\"\n");
  EXPECT_EQ(read.name, "drive");
  EXPECT_EQ(read.description, "x");
  EXPECT_EQ(load("[scene]\n").name, "s");
}

TEST_F(SceneFile, WholeNumbersMayBeFloats) { EXPECT_EQ(load("air.num_parcels = 1e6").num_parcels, 1000000); }

TEST_F(SceneFile, UnknownKeyNamesLineAndNearest) {
  EXPECT_EQ(refusal("# a\n[air]\nrestituton = 1\n"),
            "s.toml:3: 'air.restituton' is not a setting; the nearest is air.restitution (all: pickleflight "
            "--help)");
}

TEST_F(SceneFile, UnknownSectionNamesLineAndNearest) {
  EXPECT_EQ(
      refusal("\n[bal]\nheld = true\n"),
      "s.toml:2: 'bal' is not a section; the nearest is [ball]; sections: scene, world, air, ball, run, "
      "view");
  EXPECT_EQ(refusal("restitution = 0.5\n"),
            "s.toml:1: 'restitution' is a setting of [air]; write it below that line");
  EXPECT_TRUE(contains(refusal("air = 1\n"), "s.toml:1: 'air' must be a section, written [air]"));
  EXPECT_TRUE(contains(refusal("[[air]]\n"), "'air' must be a section"));
}

TEST_F(SceneFile, RejectsAWrongType) {
  EXPECT_EQ(refusal("[air]\nrestitution = \"0.9\"\n"),
            "s.toml:2: air.restitution has a value of the wrong type; it takes a number without quotes, as "
            "restitution = 0.9");
  EXPECT_TRUE(contains(refusal("[ball]\nheld = 1\n"), "s.toml:2: ball.held has a value of the wrong type"));
  EXPECT_TRUE(contains(refusal("[run]\nmethod = 1\n"), "as method = \"impulse\""));
  EXPECT_TRUE(contains(refusal("[run]\ndt_s = true\n"), "wrong type"));
  EXPECT_TRUE(contains(refusal("[run]\nseed = 9007199254740993.0\n"), "is out of range"));
  EXPECT_TRUE(contains(refusal("[run]\ndt_s = 1979-05-27\n"), "wrong type"));
  EXPECT_TRUE(contains(refusal("[run]\ndt_s = [1]\n"), "wrong type"));
  EXPECT_TRUE(contains(refusal("[run.dt_s]\nx = 1\n"), "wrong type"));
  EXPECT_TRUE(contains(refusal("[scene]\nname = 1\n"), "s.toml:2: scene.name takes a text"));
  EXPECT_TRUE(contains(refusal("[scene]\nname = \"\"\n"), "s.toml:2: scene.name takes a text"));
}

TEST_F(SceneFile, ValuesAreCheckedWithTheirLine) {
  EXPECT_EQ(refusal("[air]\n\nrestitution = 1.5\n"),
            "s.toml:3: '1.5' is out of range; air.restitution takes a number from 0 to 1 (default 0.9)");
  EXPECT_TRUE(contains(refusal("[run]\ndt_s = nan\n"), "s.toml:2: 'nan' is not a finite number"));
  EXPECT_TRUE(contains(refusal("[run]\ndt_s = inf\n"), "s.toml:2: 'inf' is not a finite number"));
  EXPECT_TRUE(
      contains(refusal("[run]\nmethod = \"exat\"\n"), "s.toml:2: 'exat' is unknown, the nearest is exact"));
  EXPECT_TRUE(contains(refusal("[air]\nnum_parcels = 1.5\n"), "is not a whole number"));
}

TEST_F(SceneFile, MalformedTomlNamesTheLine) {
  const std::string message = refusal("[air]\nrestitution = \n");
  EXPECT_TRUE(contains(message, "s.toml:2: not valid TOML: ")) << message;
  EXPECT_FALSE(contains(message, "\n"));
  EXPECT_TRUE(contains(refusal("[run]\nseed = 1\nseed = 2\n"), "s.toml:3: not valid TOML"));
  EXPECT_TRUE(contains(refusal(std::string("a\0b", 3)), "not valid TOML"));
}

// A parser that calls itself would overflow the stack.
TEST_F(SceneFile, RejectsKeysOfVeryManyParts) {
  std::string key = "a";
  for (int k = 0; k < 50000; ++k) key += ".a";
  EXPECT_NE(refusal(key + " = 1").find("a key has more than 1000 parts"), std::string::npos);
  EXPECT_NE(refusal("[" + key + "]").find("a key has more than 1000 parts"), std::string::npos);
  EXPECT_NE(refusal("\"=\"." + key + " = 1").find("a key has more than 1000 parts"), std::string::npos);
  EXPECT_NE(refusal("x = { " + key + " = 1 }").find("a key has more than 1000 parts"), std::string::npos);
  std::string quoted = "a";
  for (int k = 0; k < 50000; ++k) quoted += " . 'a' . \"\\\"\"";
  EXPECT_NE(refusal(quoted + " = 1").find("a key has more than 1000 parts"), std::string::npos);
}

TEST_F(SceneFile, TakesTextsOfVeryManyDots) {
  const std::string dots(490, '.');
  EXPECT_EQ(refusal("# " + std::string(5000, '.') + "\n[scene]\ndescription = \"\\\"" + dots + "\"\n"), "");
  EXPECT_EQ(refusal("[scene]\ndescription = \"\"\"\n\"" + dots + "\n" + dots + "\"\"\"\n"), "");
}

TEST_F(SceneFile, RejectsBinaryFiles) {
  std::string junk;
  for (unsigned i = 0, x = 1; i < 4096; ++i)
    junk += static_cast<char>((x = x * 1664525U + 1013904223U) >> 24);
  for (const std::string& text :
       {junk, std::string("[scene]\nname = \"caf\xe9\"\n"), std::string("\xff\xfe[\0a\0]\0", 8),
        std::string("\x89PNG\r\n\x1a\n"), std::string(4096, '\0')}) {
    const std::string message = refusal(text);
    EXPECT_TRUE(contains(message, "not valid TOML")) << message;
    EXPECT_TRUE(message.starts_with("s.toml:")) << message;
    EXPECT_FALSE(contains(message, "\n"));
  }
}

TEST_F(SceneFile, RejectsEmptyFiles) {
  for (const char* text : {"", "\n \n", "# a comment\n"}) {
    EXPECT_EQ(refusal(text),
              "s.toml: is empty; give at least one setting, as [air] and below it restitution = 0.9");
  }
}

TEST_F(SceneFile, RejectsLargeFiles) {
  const std::string head = "[run]\nseed = 7\n#";
  EXPECT_EQ(load(head + std::string((1U << 20) - head.size(), 'x')).seed, 7);
  EXPECT_EQ(refusal(head + std::string((1U << 20) - head.size() + 1, 'x')),
            "s.toml: is larger than 1 MiB, the limit for a scene file (it has 1048577 bytes)");
}

// A file of 100 MB that takes no space on the disk. It is refused for its size. Reading it would take long
// and lead to another message.
TEST_F(SceneFile, DoesNotReadAHugeFile) {
  const auto file = folder_.write("huge.toml", "");
  std::filesystem::resize_file(file, 100'000'000);
  EXPECT_TRUE(contains(message_of([&] { load_scene_file(file); }), "(it has 100000000 bytes)"));
}

TEST_F(SceneFile, RejectsUnreadableFiles) {
  const auto message = [](const std::filesystem::path& file) {
    return message_of([&] { load_scene_file(file); });
  };
  EXPECT_TRUE(contains(message(folder_.path() / "none.toml"), "cannot be read; check that the file exists"));
  EXPECT_TRUE(contains(message(folder_.path()), "is a folder; give a scene file"));
  EXPECT_TRUE(contains(message("/dev/zero"), "is not a regular file"));
  const auto pipe = folder_.path() / "pipe.toml";  // opening it would wait for a writer
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_TRUE(contains(message(pipe), "is not a regular file"));
  // This file opens, has no size, and fails when read, even for root, which ignores permissions.
  EXPECT_TRUE(contains(message("/proc/self/mem"), "cannot be read"));
  const auto secret = folder_.write("secret.toml", "[scene]\n");
  std::filesystem::permissions(secret, std::filesystem::perms::none);
  EXPECT_TRUE(::geteuid() == 0 || contains(message(secret), "cannot be read"));
}

TEST_F(SceneFile, SavedSettingsReadBackUnchanged) {
  Settings settings;
  settings.name = "odd \"name\" \\ \n\x01";
  settings.description = "tab\there, caf\xc3\xa9";
  settings.width_m = 1.0 / 3.0;
  settings.boundary = Boundary::periodic;
  settings.box_follows_parcels = true;
  settings.num_parcels = 123456789;
  settings.parcel_mass_kg = 1e-8;
  settings.neighbors = Neighbors::all_pairs;
  settings.ball_vx_mps = -1e5;
  settings.relaunch = false;
  const auto file = folder_.path() / "saved.toml";
  save_scene_file(file, settings);
  EXPECT_EQ(load_scene_file(file), settings) << contents_of(file);
}

TEST_F(SceneFile, SavesOnlyChangesWithUnits) {
  Settings settings;
  settings.ball_vx_mps = 20.0;
  const auto file = folder_.path() / "saved.toml";
  save_scene_file(file, settings);
  EXPECT_EQ(contents_of(file),
            "[scene]\nname = \"court\"\n\n[ball]\nvx_mps = 20  # [m/s] initial velocity of the "
            "ball along x\n");
}

TEST_F(SceneFile, RejectsAnUnwritableFile) {
  const auto file = folder_.path() / "missing" / "s.toml";
  EXPECT_TRUE(contains(message_of([&] { save_scene_file(file, Settings{}); }), "No such file or directory"));
  EXPECT_THROW(save_scene_file(file, Settings{}), OutputError);
}

TEST(Scenes, ShippedScenesAreListedAndLoad) {
  std::vector<std::string> names;
  for (const SceneEntry& scene : list_scenes()) {
    names.push_back(scene.name);
    EXPECT_NO_THROW(EXPECT_EQ(load_scene_file(scene.file).name, scene.name)) << scene.file;
    EXPECT_FALSE(load_scene_file(scene.file).description.empty()) << scene.file;
  }
  EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));
  for (const char* name : {"court", "gas"}) {
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
  }
}

TEST(Scenes, CourtHasTheDefaults) {
  Settings court = load_scene("court");
  court.description.clear();
  EXPECT_EQ(court, Settings{});
}

TEST(Scenes, GasIsTheReference) {
  const Settings gas = load_scene("gas");
  EXPECT_TRUE(gas.box_follows_parcels);
  EXPECT_FALSE(gas.ball_present);
  EXPECT_EQ(gas.boundary, Boundary::walls);
  EXPECT_EQ(gas.parcel_radius_m, 0.5);
  EXPECT_EQ(gas.parcel_mass_kg, 1.0);
  EXPECT_EQ(gas.parcel_speed_mps, 1.0);
  EXPECT_EQ(gas.area_fraction, 0.2);
  EXPECT_EQ(gas.restitution, 1.0);
  EXPECT_EQ(gas.dt_s, 0.035);
  EXPECT_EQ(gas.substeps, 1);
  EXPECT_EQ(gas.num_parcels_cpu, 20000);
  EXPECT_EQ(gas.num_parcels_gpu, 1000000);
  EXPECT_GE(gas.time_scale, gas.dt_s * gas.frame_rate_hz);  // never slows the run
}

TEST(Scenes, UnknownNameListsKnownOnes) {
  const std::string message = message_of([] { load_scene("cort"); });
  EXPECT_TRUE(contains(message, "'cort' is not a scene; the nearest is court; known: ")) << message;
  EXPECT_TRUE(contains(message, "gas")) << message;
}

TEST(Scenes, EnvironmentComesFirst) {
  TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "scenes");
  folder.write("scenes/gas.toml", "[run]\nseed = 99\n");
  folder.write("scenes/own.toml", "[run]\nseed = 98\n");
  folder.write("scenes/readme.txt", "no scene");
  const AssetsVariable variable(folder.path());
  EXPECT_EQ(load_scene("gas").seed, 99);
  EXPECT_EQ(load_scene("own").seed, 98);
  EXPECT_EQ(load_scene("court").seed, 1);
  EXPECT_EQ(find_asset("scenes/own.toml"), folder.path() / "scenes/own.toml");
  EXPECT_EQ(asset_folders().front(), folder.path());
  for (const SceneEntry& scene : list_scenes()) EXPECT_NE(scene.name, "readme");
}

TEST(Assets, MissingAssetListsSearchedFolders) {
  const std::string message = message_of([] { find_asset("no/such.png"); });
  EXPECT_TRUE(contains(message, "no/such.png: not found in ")) << message;
  for (const auto& folder : asset_folders()) EXPECT_TRUE(contains(message, folder.string())) << message;
}

TEST_F(SceneFile, ANewOneThatCannotBeWrittenWholeIsNotThere) {
  const auto file = folder_.path() / "new.toml";
  {
    const test::FullDisk full(10);
    EXPECT_THROW(save_new_scene_file(file, Settings{}), UserError);
  }
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_NO_THROW(save_new_scene_file(file, Settings{}));
}

// Names of files need not be UTF-8, and a log names files.
TEST(TomlString, IsUtf8) {
  for (const char* good : {"", "a", "\u00FC", "\u20AC", "\uFFFD", "\U0001F3D3"})
    EXPECT_EQ(toml_string(good), std::string("\"") + good + "\"");
  EXPECT_EQ(toml_string("a\"b\\c\n"), R"("a\"b\\c\u000A")");
  EXPECT_EQ(toml_string("a\xFF-b"), R"("a\uFFFD-b")");
  EXPECT_EQ(toml_string("\xC3"), R"("\uFFFD")");                      // cut off
  EXPECT_EQ(toml_string("\xC0\x80"), R"("\uFFFD\uFFFD")");            // longer than need be
  EXPECT_EQ(toml_string("\xED\xA0\x80"), R"("\uFFFD\uFFFD\uFFFD")");  // a surrogate
  EXPECT_EQ(toml_string("\xF4\x90\x80\x80"), R"("\uFFFD\uFFFD\uFFFD\uFFFD")");
}

}  // namespace
}  // namespace pf
