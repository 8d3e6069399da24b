// Dumps: frames that a run goes on from, text for OVITO, and the queue that writes them.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>

#include "app/run_state.hpp"
#include "core/error.hpp"
#include "data/dump.hpp"
#if PF_HAVE_HDF5
#include "data/h5_layout.hpp"
#endif
#include "data/random_scenes.hpp"
#include "data/xdmf.hpp"
#include "data/xyz_dump.hpp"
#include "support/full_disk.hpp"
#include "unit/temporary_folder.hpp"

namespace pf::test {
namespace {

class Dump : public testing::Test {
 protected:
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "a.h5";
  int num_written_ = 0;

  End run(const RandomScene& scene, const DumpFormat& format = {}) {
    Simulation simulation(scene.settings, make_cpu_backend(2));
    const auto sink = make_h5_dump(file_, format);
    std::uint64_t num_steps = 0;
    for (int frame = 0; frame <= scene.num_frames; ++frame) {
      RunState state;
      simulation.save(state);
      if (frame == 0 || state.totals.num_steps > num_steps) {  // not of a ball that has left
        sink->write(state);
        num_written_ = frame + 1;
      }
      num_steps = state.totals.num_steps;
      if (frame < scene.num_frames) advance(simulation, 1);
    }
    sink->finish();
    return end_of(simulation);
  }
  std::string refusal(std::optional<std::int64_t> frame = {}) const {
    try {
      read_h5_frame(file_, frame);
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
};

// At each byte at which the disk may be full the index has the frames before, and its end.
TEST_F(Dump, TheIndexIsWholeOnAFullDisk) {
  const std::filesystem::path index = folder_.path() / "a.xdmf";
  const XdmfFile::Layout layout{"a.h5", 10, true};
  XdmfFile whole(index, layout);
  whole.add_frame(0.0, 1);
  const std::string one = contents_of(index);
  whole.add_frame(0.5, 2);
  const std::string two = contents_of(index);
  for (std::size_t num_bytes = one.size(); num_bytes < two.size(); num_bytes += 7) {
    XdmfFile file(index, layout);
    file.add_frame(0.0, 1);
    const FullDisk full(num_bytes);
    EXPECT_THROW(file.add_frame(0.5, 2), UserError);
    EXPECT_EQ(contents_of(index), one) << num_bytes;
  }
}

#if PF_HAVE_HDF5

TEST_F(Dump, LeavesNothingBesideAFolderOfItsName) {
  std::filesystem::create_directory(file_);
  RunState state;
  Simulation(random_scene(0).settings, make_cpu_backend(1)).save(state);
  EXPECT_THROW(make_h5_dump(file_, {})->write(state), DeviceError);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "a.h5.part"));
}

TEST_F(Dump, GoesOnFromAnyFrameToTheSameBits) {
  for (unsigned number = 0; number < 13; ++number) {
    const RandomScene scene = number < 12 ? random_scene(number) : heating_scene(8);
    const End expected = run(scene, {true, true, static_cast<int>(number % 3)});
    const int from = std::min(scene.saved_after, num_written_ - 1);
    const RunState state = read_h5_frame(file_, from);
    if (number == 12) {
      EXPECT_FALSE(state.backend.parcels.heated.empty());
    }
    Simulation again(state, make_cpu_backend(1));
    advance(again, scene.num_frames - from);
    EXPECT_EQ(end_of(again), expected) << scene.text << ", from frame " << from;
    Simulation last(read_h5_frame(file_, std::nullopt), make_cpu_backend(1));
    EXPECT_EQ(end_of(last), expected) << scene.text << ", the last frame";
  }
}

TEST_F(Dump, KeepsTextsOfSeveralLines) {
  RandomScene scene = random_scene(2);
  scene.num_frames = 1;
  for (const char* text : {"two\nlines", "\n", "\n\n  x = 1\n ", "C:\\name \\n", "a\r\nball.x_m = 3\n"}) {
    scene.settings.description = text;
    const End expected = run(scene);
    const RunState state = read_h5_frame(file_, std::nullopt);
    EXPECT_EQ(state.settings.description, text);
    Simulation again(state, make_cpu_backend(1));
    EXPECT_EQ(end_of(again), expected);
  }
}

TEST_F(Dump, RefusesWhatCannotBeStartedFrom) {
  RandomScene scene = random_scene(2);
  scene.num_frames = 2;
  run(scene);
  EXPECT_EQ(refusal(), "");
  EXPECT_NE(refusal(3).find("has no frame 3; --from-frame takes 0 to 2"), std::string::npos) << refusal(3);
  run(scene, {true, false, 0});
  EXPECT_NE(refusal().find("has no exact positions"), std::string::npos) << refusal();
  run(scene, {false, true, 0});
  EXPECT_NE(refusal().find("has no velocities"), std::string::npos) << refusal();
  folder_.write("a.h5", "not HDF5");
  EXPECT_NE(refusal().find("cannot be opened as HDF5"), std::string::npos) << refusal();
}

// A damaged file must not write beyond what a frame is read to.
TEST_F(Dump, RefusesFramesOfAnotherShape) {
  RandomScene scene = random_scene(2);
  scene.num_frames = 1;
  for (const char* path : {dump_path::kUnits, dump_path::kVelocity, dump_path::kHeated, dump_path::kHash,
                           dump_path::kRun, dump_path::kFormat}) {
    run(scene);
    {
      const h5::Handle file(H5Fopen(file_.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose, "file");
      std::vector<hsize_t> extent = h5::extent_of(h5::open_dataset(file.id(), path).id());
      extent.push_back(100);
      const h5::Handle type(H5Dget_type(h5::open_dataset(file.id(), path).id()), H5Tclose, path);
      const h5::Handle space(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr),
                             H5Sclose, path);
      h5::checked(H5Ldelete(file.id(), path, H5P_DEFAULT), path);
      const h5::Handle wide(
          H5Dcreate2(file.id(), path, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose,
          path);
    }
    EXPECT_NE(refusal(), "") << path;
  }
}

TEST_F(Dump, ReplacesTheTargetOfALink) {
  const std::filesystem::path target = folder_.write("target.h5", "an earlier dump");
  std::filesystem::create_symlink("target.h5", file_);
  RandomScene scene = random_scene(2);
  scene.num_frames = 1;
  run(scene);
  EXPECT_TRUE(std::filesystem::is_symlink(file_));
  EXPECT_EQ(refusal(), "");
  EXPECT_FALSE(std::filesystem::is_symlink(target));
}

// Another number of parcels, and a step back, begin files of their own.
TEST_F(Dump, BeginsAnotherFileWhereARunDoesNotContinue) {
  const auto sink = make_h5_dump(file_, {});
  const auto mine = folder_.write("a-2.h5", "mine"), index = folder_.write("a-4.xdmf", "mine");
  for (const std::int64_t n : {40, 40, 50}) {
    Simulation simulation(gas(n), make_cpu_backend(1));
    advance(simulation, 2);
    RunState state;
    simulation.save(state);
    sink->write(state);
  }
  sink->finish();
  for (const auto& [name, n] : {std::pair("a.h5", 40U), std::pair("a-3.h5", 40U), std::pair("a-5.h5", 50U)}) {
    const RunState state = read_h5_frame(folder_.path() / name, 0);
    EXPECT_EQ(state.backend.parcels.position.size(), n) << name;
    EXPECT_TRUE(std::filesystem::exists((folder_.path() / name).replace_extension(".xdmf"))) << name;
  }
  EXPECT_EQ(contents_of(mine) + contents_of(index), "minemine") << "files of others";
  EXPECT_EQ(sink->further_files(), (std::vector{folder_.path() / "a-3.h5", folder_.path() / "a-5.h5"}));
}

// A state without ticks of last contacts would get them as zeros, and its trajectories would begin anew.
TEST_F(Dump, BeginsAnotherFileWhereTheContactClockStops) {
  Settings settings = gas(40);
  settings.method = Method::exact;
  settings.restitution = 0.8;
  settings.contact_clock = 0.01;
  const auto sink = make_h5_dump(file_, {});
  Simulation simulation(settings, make_cpu_backend(1));
  RunState state;
  for (const double restitution : {0.8, 1.0}) {
    settings.restitution = restitution;
    Commands commands;
    commands.settings = settings;
    simulation.begin_frame(commands, nullptr);
    simulation.finish_frame();
    advance(simulation, 2);
    simulation.save(state);
    sink->write(state);
  }
  sink->finish();
  EXPECT_TRUE(read_h5_frame(file_, 0).backend.exact.last_contact_tick.size() == 40U);
  const RunState second = read_h5_frame(folder_.path() / "a-2.h5", 0);
  EXPECT_TRUE(second.backend.exact.active && second.backend.exact.last_contact_tick.empty());
}

// Energies in the file are of one mass.
TEST_F(Dump, BeginsAnotherFileWithTheMass) {
  Settings settings = gas(40);
  const auto sink = make_h5_dump(file_, {});
  RunState state;
  for (const double mass_kg : {1.0, 2.0}) {
    settings.parcel_mass_kg = mass_kg;
    Simulation simulation(settings, make_cpu_backend(1));
    advance(simulation, mass_kg < 2.0 ? 2 : 4);
    simulation.save(state);
    sink->write(state);
  }
  sink->finish();
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "a-2.h5"));
}

#else

TEST_F(Dump, WithoutHdf5IsRefusedWithThePackage) {
  EXPECT_NE(refusal().find("libhdf5-dev"), std::string::npos) << refusal();
}

#endif

TEST_F(Dump, AsTextHasTheParcelsThatAreThere) {
  Settings s = gas(60, 0.1, Boundary::open);
  Simulation simulation(s, make_cpu_backend(1));
  advance(simulation, 200);
  RunState state;
  simulation.save(state);
  ASSERT_GT(simulation.view().totals.num_retired, 0U);
  const auto num_present = 60 - simulation.view().totals.num_retired;
  const std::string text = xyz_frame(state);
  EXPECT_EQ(text.substr(0, text.find('\n')), std::to_string(num_present));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), static_cast<std::ptrdiff_t>(num_present) + 2);
  EXPECT_NE(text.find("Properties=id:I:1:pos:R:3:velo:R:3:radius:R:1"), std::string::npos);
}

// Holds up each write until it may go on.
class SlowSink final : public StateSink {
 public:
  explicit SlowSink(std::atomic<bool>& may_write) : may_write_(may_write) {}
  void write(const RunState& state) override {
    if (state.num_frames == 99) throw UserError("the disk is full");
    may_write_.wait(false);
  }
  void finish() override {}
  std::uint64_t num_bytes() const override { return 0; }

 private:
  std::atomic<bool>& may_write_;
};

TEST(StateWriter, CountsWhatItDrops) {
  std::atomic<bool> may_write{false};
  StateWriter writer(std::make_unique<SlowSink>(may_write), 2);
  int num_added = 0;
  for (int frame = 0; frame < 5; ++frame) {
    if (!writer.has_room(StateWriter::WhenFull::drop)) continue;
    writer.add(std::make_shared<RunState>());
    ++num_added;
  }
  may_write = true;
  may_write.notify_all();
  writer.finish();
  EXPECT_EQ(num_added, 2);
  EXPECT_EQ(writer.counts().num_written, 2);
  EXPECT_EQ(writer.counts().num_dropped, 3);
}

TEST(StateWriter, EndsTheFileAndNotTheRunOnAnError) {
  std::atomic<bool> may_write{true};
  StateWriter writer(std::make_unique<SlowSink>(may_write), 1);
  auto state = std::make_shared<RunState>();
  state->num_frames = 99;
  ASSERT_TRUE(writer.has_room(StateWriter::WhenFull::wait));
  writer.add(state);
  EXPECT_FALSE(writer.has_room(StateWriter::WhenFull::wait));
  EXPECT_EQ(writer.failure(), "the disk is full");
  writer.fail("no memory");
  EXPECT_EQ(writer.failure(), "the disk is full") << "the first reason stays";
}

TEST(StateWriter, FailsForAReasonFromOutside) {
  std::atomic<bool> may_write{true};
  StateWriter writer(std::make_unique<SlowSink>(may_write), 1);
  writer.fail("the state cannot be copied (no memory)");
  EXPECT_FALSE(writer.has_room(StateWriter::WhenFull::wait));
  EXPECT_EQ(writer.failure(), "the state cannot be copied (no memory)");
}

}  // namespace
}  // namespace pf::test
