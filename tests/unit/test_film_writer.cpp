// The queue between the run and its film: order, repeats, a full queue, failures.
#include "app/film_writer.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <future>

#include "core/error.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Taken {
  std::mutex mutex;
  std::vector<int> frames;  // first byte of each
  bool finished = false;
  int fail_at = -1;                // the frame that cannot be written
  std::shared_future<void> go_on;  // if valid, each frame waits for it
};

class RecordingSink final : public FrameSink {
 public:
  explicit RecordingSink(std::shared_ptr<Taken> taken) : taken_(std::move(taken)) {}
  void add_frame(std::span<const std::uint8_t> rgba) override {
    if (taken_->go_on.valid()) taken_->go_on.wait();
    const std::lock_guard lock(taken_->mutex);
    if (static_cast<int>(taken_->frames.size()) == taken_->fail_at) throw DeviceError("the disk is full");
    taken_->frames.push_back(rgba[0]);
  }
  void finish() override { taken_->finished = true; }
  std::string name() const override { return "recording"; }

 private:
  std::shared_ptr<Taken> taken_;
};

HeldFrame frame(int value) {
  const auto bytes = std::make_shared<Bytes>(16, static_cast<std::uint8_t>(value));
  return {*bytes, bytes};
}

TEST(FilmWriter, KeepsOrderAndRepeats) {
  const auto taken = std::make_shared<Taken>();
  {
    FilmWriter writer(std::make_unique<RecordingSink>(taken), 2);
    for (int i = 0; i < 20; ++i)
      EXPECT_TRUE(writer.add(frame(i), i == 3 ? 3 : 1, FilmWriter::WhenFull::wait));
  }
  std::vector<int> expected;
  for (int i = 0; i < 20; ++i) expected.insert(expected.end(), i == 3 ? 3U : 1U, i);
  EXPECT_EQ(taken->frames, expected);
  EXPECT_TRUE(taken->finished);
}

TEST(FilmWriter, RefusesWhenFullAndAcceptsLater) {
  const auto taken = std::make_shared<Taken>();
  std::promise<void> gate;
  taken->go_on = gate.get_future().share();
  {
    FilmWriter writer(std::make_unique<RecordingSink>(taken), 3);
    // Each of the three buffers is either waiting or being written.
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(writer.add(frame(i), 1, FilmWriter::WhenFull::refuse));
    EXPECT_FALSE(writer.add(frame(3), 1, FilmWriter::WhenFull::refuse));
    gate.set_value();
    EXPECT_TRUE(writer.add(frame(4), 1, FilmWriter::WhenFull::wait));
  }
  EXPECT_EQ(taken->frames, (std::vector<int>{0, 1, 2, 4}));
}

TEST(FilmWriter, FailureIsReportedAndLossesAreCounted) {
  const auto taken = std::make_shared<Taken>();
  taken->fail_at = 2;
  FilmWriter writer(std::make_unique<RecordingSink>(taken), 2);
  int num_refused = 0;
  for (int i = 0; i < 20; ++i) num_refused += writer.add(frame(i), 1, FilmWriter::WhenFull::wait) ? 0 : 1;
  EXPECT_GT(num_refused, 10);
  writer.close();
  while (!writer.done()) std::this_thread::yield();
  EXPECT_EQ(writer.failure(), "the disk is full");
  EXPECT_EQ(writer.num_written(), 2);
  EXPECT_EQ(writer.num_written() + writer.num_lost() + num_refused, 20);
  EXPECT_FALSE(taken->finished);
}

TEST(FilmWriter, FailureReleasesWaitingFrames) {
  const auto taken = std::make_shared<Taken>();
  taken->fail_at = 0;
  std::promise<void> gate;
  taken->go_on = gate.get_future().share();
  FilmWriter writer(std::make_unique<RecordingSink>(taken), 4);
  std::vector<std::weak_ptr<const void>> keepers;
  for (int i = 0; i < 4; ++i) {
    HeldFrame held = frame(i);
    keepers.push_back(held.keeper);
    ASSERT_TRUE(writer.add(std::move(held), 1, FilmWriter::WhenFull::refuse));
  }
  gate.set_value();
  while (!writer.done()) std::this_thread::yield();
  for (const auto& keeper : keepers) EXPECT_TRUE(keeper.expired());
}

// A frame's memory must be held until it is written, and released afterwards.
TEST(FilmWriter, MemoryIsHeldExactlyUntilItIsWritten) {
  const auto taken = std::make_shared<Taken>();
  std::promise<void> gate;
  taken->go_on = gate.get_future().share();
  std::vector<std::weak_ptr<const void>> keepers;
  FilmWriter writer(std::make_unique<RecordingSink>(taken), 3);
  for (int i = 0; i < 3; ++i) {
    HeldFrame held = frame(i);
    keepers.push_back(held.keeper);
    ASSERT_TRUE(writer.add(std::move(held), 1, FilmWriter::WhenFull::refuse));
  }
  for (const auto& keeper : keepers) EXPECT_FALSE(keeper.expired());
  HeldFrame refused = frame(3);
  const std::weak_ptr<const void> keeper = refused.keeper;
  EXPECT_FALSE(writer.add(std::move(refused), 1, FilmWriter::WhenFull::refuse));
  EXPECT_TRUE(keeper.expired());
  gate.set_value();
  writer.close();
  while (!writer.done()) std::this_thread::yield();
  for (const auto& one : keepers) EXPECT_TRUE(one.expired());
  EXPECT_GT(writer.write_ms(), 0.0);
}

TEST(RawFrames, HasTheTopRowFirst) {
  TemporaryFolder folder;
  const auto file = folder.path() / "a.rgb";
  {
    RawFrames raw(file, 1);
    raw.add_frame(Bytes{1, 2, 3, 4, 5, 6, 7, 8});
    raw.finish();
  }
  EXPECT_EQ(contents_of(file), std::string("\5\6\7\10\1\2\3\4"));
}

TEST(RawFrames, ReportsAFullDisk) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  RawFrames raw("/dev/full", 1);
  try {
    raw.add_frame(Bytes(4 * 1'000'000));
    raw.finish();
    FAIL() << "was written";
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("No space left"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace pf
