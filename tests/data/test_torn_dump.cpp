// A dump whose writer is killed at any moment: each write to the file is done again in a copy, up to each
// page of the system, since a kill may end a write there, and the copy is read.
//
// pwrite() and ftruncate() of this program, which HDF5 calls, are therefore those of this file.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "app/run_state.hpp"
#include "core/error.hpp"
#include "data/dump.hpp"
#include "data/random_scenes.hpp"
#include "unit/temporary_folder.hpp"

namespace {

struct FileChange {
  bool cuts;          // the file's end becomes the offset
  bool is_named;      // the file has its name, so that others may read it
  std::string bytes;  // to be written at the offset
  off_t offset;
};

bool is_recording = false;
std::vector<FileChange> changes;  // of a.h5, which is made as a.h5.part

void record(int fd, bool cuts, const void* bytes, std::size_t num, off_t offset) {
  if (!is_recording) return;
  std::error_code error;
  const auto file = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(fd), error).filename();
  if (file == "a.h5" || file == "a.h5.part")
    changes.push_back({cuts, file == "a.h5", std::string(static_cast<const char*>(bytes), num), offset});
}

ssize_t write_at(int fd, const void* bytes, std::size_t num, off_t offset) {
  record(fd, false, bytes, num, offset);
  return syscall(SYS_pwrite64, fd, bytes, num, offset);
}

int set_end(int fd, off_t end) {
  record(fd, true, "", 0, end);
  return static_cast<int>(syscall(SYS_ftruncate, fd, end));
}

}  // namespace

extern "C" {
ssize_t pwrite(int fd, const void* bytes, std::size_t num, off_t offset) {
  return write_at(fd, bytes, num, offset);
}
ssize_t pwrite64(int fd, const void* bytes, std::size_t num, off64_t offset) {
  return write_at(fd, bytes, num, offset);
}
int ftruncate(int fd, off_t end) noexcept { return set_end(fd, end); }
int ftruncate64(int fd, off64_t end) noexcept { return set_end(fd, end); }
}

namespace pf::test {
namespace {

#if PF_HAVE_HDF5

constexpr off_t kPageBytes = 4096;

class TornDump : public testing::TestWithParam<int> {
 protected:
  TornDump() { fd_ = ::open(copy_.c_str(), O_RDWR | O_CREAT, 0600); }
  ~TornDump() override {
    is_recording = false;
    ::close(fd_);
  }

  void write_frames(int num_frames, int compression) {
    changes.clear();
    is_recording = true;
    Simulation simulation(random_scene(2).settings, make_cpu_backend(1));
    const auto sink = make_h5_dump(folder_.path() / "a.h5", {true, true, compression});
    for (int frame = 0; frame < num_frames; ++frame) {
      RunState state;
      simulation.save(state);
      sink->write(state);
      advance(simulation, 1);
    }
    is_recording = false;
    sink->finish();
  }

  // Does a change again in the copy, up to each page, and calls `check` each time.
  template <class Check>
  void redo(const FileChange& change, Check check) {
    if (change.cuts) {
      ASSERT_EQ(::ftruncate(fd_, change.offset), 0);
      check();
      return;
    }
    const auto num = static_cast<off_t>(change.bytes.size());
    for (off_t done = 0; done < num;) {
      const off_t piece = std::min(num - done, kPageBytes - (change.offset + done) % kPageBytes);
      ASSERT_EQ(::pwrite(fd_, change.bytes.data() + done, piece, change.offset + done), piece);
      done += piece;
      check();
    }
  }

  // Reads the last of the complete frames again, and looks for a further one. Returns what is wrong.
  std::string read_copy() {
    try {
      if (num_complete_ > 0) read_h5_frame(copy_, num_complete_ - 1);
      read_h5_frame(copy_, num_complete_);
      ++num_complete_;
    } catch (const UserError& error) {
      const std::string text = error.what();
      const bool has_no_more = text.find("has no complete frame") != std::string::npos ||
                               text.find("has no frame") != std::string::npos;
      return has_no_more ? "" : text;
    }
    return "";
  }

  TemporaryFolder folder_;
  std::filesystem::path copy_ = folder_.path() / "copy.h5";
  int fd_ = -1;
  int num_complete_ = 0;
};

TEST_P(TornDump, IsReadUpToTheLastCompleteFrame) {
  constexpr int kNumFrames = 20;
  write_frames(kNumFrames, GetParam());
  std::size_t num_read = 0;
  for (const FileChange& change : changes) {
    redo(change, [&] {
      if (!change.is_named) return;
      ++num_read;
      EXPECT_EQ(read_copy(), "") << "offset " << change.offset << ", " << change.bytes.size()
                                 << " bytes, frame " << num_complete_;
    });
  }
  EXPECT_EQ(num_complete_, kNumFrames);
  EXPECT_GT(num_read, 20U * kNumFrames);
}

INSTANTIATE_TEST_SUITE_P(Compression, TornDump, testing::Values(0, 4));

#endif

}  // namespace
}  // namespace pf::test
