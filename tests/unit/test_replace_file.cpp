// Files that are written aside and renamed.
#include "core/replace_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include "support/full_disk.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

TEST(ReplaceFile, AFullDiskLeavesWhatWasThere) {
  const TemporaryFolder folder;
  const auto file = folder.write("a", "before");
  {
    const test::FullDisk full(8);
    EXPECT_NE(replace_file(file, std::string(100, 'x')), "");
  }
  EXPECT_EQ(contents_of(file), "before");
  EXPECT_FALSE(std::filesystem::exists(part_of(file)));
  EXPECT_EQ(replace_file(file, "after"), "");
  EXPECT_EQ(contents_of(file), "after");
}

TEST(ReplaceFile, RemovesOnlyFilesWithoutAByte) {
  const TemporaryFolder folder;
  const auto empty = folder.write("empty", ""), full = folder.write("full", "x"),
             none = folder.path() / "none";
  const auto link = folder.path() / "link";
  std::filesystem::create_symlink("/dev/null", link);
  for (const auto& file : {empty, full, link, none, folder.path()}) remove_if_empty(file);
  EXPECT_FALSE(std::filesystem::exists(empty));
  EXPECT_TRUE(std::filesystem::exists(full) && std::filesystem::exists(link));
}

// As /dev/stdout is, which leads there.
TEST(ReplaceFile, WritesToAnOpenPipe) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  EXPECT_EQ(replace_file("/proc/self/fd/" + std::to_string(ends[1]), "text"), "");
  char text[64] = {};
  EXPECT_EQ(::read(ends[0], text, sizeof(text) - 1), 4);
  EXPECT_EQ(std::string(text), "text");
  ::close(ends[0]);
  ::close(ends[1]);
}

}  // namespace
}  // namespace pf
