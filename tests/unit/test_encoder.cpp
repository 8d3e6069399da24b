// Films by ffmpeg, read back with ffprobe and ffmpeg.
#include "app/encoder.hpp"

#include <gtest/gtest.h>
#include <signal.h>

#include <array>
#include <cstdio>
#include <vector>

#include "core/error.hpp"
#include "support/full_disk.hpp"
#include "temporary_folder.hpp"

namespace pf {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::string output_of(const std::string& command) {
  FILE* pipe = ::popen(command.c_str(), "r");
  std::string text;
  std::array<char, 4096> buffer;
  for (std::size_t got = 0; (got = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    text.append(buffer.data(), got);
  }
  ::pclose(pipe);
  return text;
}

// "h264,yuv420p,WIDTH,HEIGHT,RATE,NUM_FRAMES"
std::string probe(const std::filesystem::path& file) {
  const auto entry = [&](const std::string& name) {
    std::string text =
        output_of("ffprobe -v error -count_frames -select_streams v:0 -show_entries stream=" + name +
                  " -of default=nw=1:nk=1 'file:" + file.string() + "'");
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text;
  };
  return entry("codec_name") + "," + entry("pix_fmt") + "," + entry("width") + "," + entry("height") + "," +
         entry("r_frame_rate") + "," + entry("nb_read_frames");
}

// First frame as grey values, top row first.
std::string first_frame(const std::filesystem::path& file) {
  return output_of("ffmpeg -v error -i 'file:" + file.string() +
                   "' -frames:v 1 -f rawvideo -pix_fmt gray - 2>/dev/null");
}

// A frame in the row order of GL, bottom row first. The upper half is white, the lower black.
Bytes white_above(int width, int height) {
  Bytes frame(4U * static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
  for (std::size_t i = frame.size() / 2; i < frame.size(); ++i) frame[i] = 255;
  return frame;
}

// Sets an environment variable during the lifetime of the object.
class PathVariable {
 public:
  explicit PathVariable(const std::string& value) : old_(std::getenv("PATH")) {
    ::setenv("PATH", value.c_str(), 1);
  }
  ~PathVariable() { ::setenv("PATH", old_.c_str(), 1); }

 private:
  std::string old_;
};

class Film : public testing::Test {
 protected:
  void SetUp() override {
    if (!ffmpeg_available()) GTEST_SKIP() << "no ffmpeg on the PATH: films are not tested";
  }
  TemporaryFolder folder_;
};

TEST_F(Film, Mp4HasFramesAndFormat) {
  const auto file = folder_.path() / "a.mp4";
  Encoder encoder(file, 64, 48, 30.0);
  const Bytes frame = white_above(64, 48);
  for (int i = 0; i < 12; ++i) encoder.add_frame(frame);
  encoder.finish();
  EXPECT_EQ(probe(file), "h264,yuv420p,64,48,30/1,12");
  EXPECT_NE(contents_of(file).find("moof"), std::string::npos) << "the film is not fragmented";
}

TEST_F(Film, LeavesNoEmptyFileOnAFullDisk) {
  const auto file = folder_.path() / "a.mp4", raw = folder_.path() / "a.rgb";
  {
    const test::FullDisk full(0);
    Encoder encoder(file, 64, 48, 30.0);
    encoder.add_frame(white_above(64, 48));
    EXPECT_THROW(encoder.finish(), DeviceError);
    RawFrames frames(raw, 64);
    const auto write = [&] {
      frames.add_frame(white_above(64, 48));
      frames.finish();
    };
    EXPECT_THROW(write(), DeviceError);
  }
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_FALSE(std::filesystem::exists(raw));
}

TEST_F(Film, FlipsRowsOfGl) {
  const auto file = folder_.path() / "a.mp4";
  Encoder encoder(file, 64, 48, 30.0);
  encoder.add_frame(white_above(64, 48));
  encoder.finish();
  const std::string pixels = first_frame(file);
  ASSERT_EQ(pixels.size(), 64U * 48U);
  EXPECT_GT(static_cast<unsigned char>(pixels[64 * 4 + 32]), 200);  // near the top
  EXPECT_LT(static_cast<unsigned char>(pixels[64 * 44 + 32]), 60);  // near the bottom
}

// Every frame, the right way up, and opaque whatever GL leaves in the alpha channel.
TEST_F(Film, AnimatedPicturesHaveAllFrames) {
  for (const char* name : {"a.gif", "a.webp"}) {
    Bytes frame = white_above(64, 48);
    Encoder encoder(folder_.path() / name, 64, 48, 20.0);
    for (std::size_t i = 0; i < 12; ++i) {
      for (std::size_t x = 5 * i; x < 5 * i + 5; ++x)
        frame[4 * x] = 255;  // another one each time: libwebp joins equal ones
      for (std::size_t alpha = 3; alpha < frame.size(); alpha += 4) frame[alpha] = 0;
      encoder.add_frame(frame);
    }
    encoder.finish();
  }
  EXPECT_EQ(probe(folder_.path() / "a.gif"), "gif,bgra,64,48,20/1,12");
  const std::string pixels = first_frame(folder_.path() / "a.gif");
  ASSERT_EQ(pixels.size(), 64U * 48U);
  EXPECT_GT(static_cast<unsigned char>(pixels[64 * 4 + 32]), 200);
  EXPECT_LT(static_cast<unsigned char>(pixels[64 * 44 + 32]), 60);
  const std::string webp = contents_of(folder_.path() / "a.webp");
  EXPECT_EQ(webp.substr(0, 4) + webp.substr(8, 4), "RIFFWEBP");
  std::size_t num_frames = 0;
  for (std::size_t at = webp.find("ANMF"); at != std::string::npos; at = webp.find("ANMF", at + 4))
    ++num_frames;
  EXPECT_EQ(num_frames, 12U);
}

TEST_F(Film, OddSizesArePadded) {
  const auto file = folder_.path() / "a.mkv";
  Encoder encoder(file, 63, 47, 60.0);
  encoder.add_frame(white_above(63, 47));
  encoder.add_frame(white_above(63, 47));
  encoder.finish();
  EXPECT_EQ(probe(file), "h264,yuv420p,64,48,60/1,2");
}

TEST_F(Film, FramesMayExceedTheSocketAndTheDestructorFinishes) {
  const auto file = folder_.path() / "a.mkv";
  {
    Encoder encoder(file, 1280, 720, 60.0);
    const Bytes frame = white_above(1280, 720);
    for (int i = 0; i < 3; ++i) encoder.add_frame(frame);
  }
  EXPECT_EQ(probe(file), "h264,yuv420p,1280,720,60/1,3");
}

TEST_F(Film, AcceptsNamesWithColonQuoteAndDash) {
  const auto old = std::filesystem::current_path();
  std::filesystem::current_path(folder_.path());
  {
    Encoder encoder("-a:b $(x);.mp4", 16, 16, 10.0);
    for (int i = 0; i < 3; ++i)
      encoder.add_frame(white_above(16, 16));  // with one frame, ffprobe guesses the rate
    encoder.finish();
  }
  std::filesystem::current_path(old);
  EXPECT_EQ(probe(folder_.path() / "-a:b $(x);.mp4"), "h264,yuv420p,16,16,10/1,3");
}

TEST_F(Film, FinishMayBeCalledTwice) {
  Encoder encoder(folder_.path() / "a.mp4", 16, 16, 10.0);
  encoder.add_frame(white_above(16, 16));
  encoder.finish();
  EXPECT_NO_THROW(encoder.finish());
}

// ffmpeg dies because it cannot write into a missing folder. The next frames must neither raise SIGPIPE nor
// be accepted silently.
TEST_F(Film, ReportsTheErrorsOfADeadFfmpeg) {
  struct sigaction deadly = {}, before = {}, after = {};
  deadly.sa_handler = SIG_DFL;
  ASSERT_EQ(::sigaction(SIGPIPE, &deadly, &before), 0);
  std::filesystem::create_directory(folder_.path() / "a.mp4");  // a folder with the film's name
  Encoder encoder(folder_.path() / "a.mp4", 640, 480, 60.0);
  const Bytes frame = white_above(640, 480);
  std::string message;
  try {
    for (int i = 0; i < 1000; ++i) encoder.add_frame(frame);
  } catch (const DeviceError& error) {
    message = error.what();
  }
  EXPECT_NE(message.find("ffmpeg failed: "), std::string::npos) << message;
  EXPECT_NE(message.find("Is a directory"), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  EXPECT_THROW(encoder.add_frame(frame), DeviceError);
  EXPECT_NO_THROW(encoder.finish());
  ASSERT_EQ(::sigaction(SIGPIPE, &before, &after), 0);
  EXPECT_EQ(after.sa_handler, SIG_DFL) << "the encoder changed the handler";
}

TEST_F(Film, FinishReportsFailure) {
  std::filesystem::create_directory(folder_.path() / "a.mkv");
  Encoder encoder(folder_.path() / "a.mkv", 16, 16, 60.0);
  EXPECT_THROW(encoder.finish(), DeviceError);
}

TEST_F(Film, RejectsWrongEndingAndMissingFolder) {
  EXPECT_THROW(Encoder(folder_.path() / "a.avi", 16, 16, 60.0), UserError);
  try {
    Encoder encoder(folder_.path() / "none" / "a.mp4", 16, 16, 60.0);
    FAIL() << "was accepted";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("does not exist"), std::string::npos) << error.what();
  }
}

TEST(FfmpegMissing, IsSaid) {
  TemporaryFolder folder;
  const PathVariable path(folder.path().string());
  EXPECT_FALSE(ffmpeg_available());
  try {
    Encoder encoder(folder.path() / "a.mp4", 16, 16, 60.0);
    FAIL() << "was accepted";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("no ffmpeg on the PATH; install it"), std::string::npos);
  }
}

// If ffmpeg fails at once, the message contains its errors.
TEST(FfmpegFailing, ErrorsAreReported) {
  TemporaryFolder folder;
  const auto program =
      folder.write("ffmpeg", "#!/bin/sh\necho first >&2\necho the encoder is gone >&2\nexit 3\n");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  const PathVariable path(folder.path().string());
  ASSERT_TRUE(ffmpeg_available());
  Encoder encoder(folder.path() / "a.mp4", 16, 16, 60.0);
  try {
    encoder.finish();
    FAIL() << "no failure reported";
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("ffmpeg failed: first; the encoder is gone"), std::string::npos)
        << error.what();
  }
}

// A fake ffmpeg that logs its arguments, and that accepts h264_nvenc if has_nvenc.
std::string encoder_chosen(bool has_nvenc, const TemporaryFolder& folder) {
  const std::string asked = (folder.path() / "asked").string();
  const auto program =
      folder.write("ffmpeg", "#!/bin/sh\necho \"$*\" >>" + asked + "\ncase \"$*\" in *lavfi*) exit " +
                                 (has_nvenc ? "0" : "1") + ";; esac\nexec /bin/cat >/dev/null\n");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  const PathVariable path(folder.path().string());
  Encoder encoder(folder.path() / "a.mp4", 16, 16, 60.0);
  encoder.add_frame(white_above(16, 16));
  encoder.finish();
  const std::string words = contents_of(asked);
  const std::string film = words.substr(words.find("rawvideo"));
  EXPECT_NE(film.find("-c:v " + encoder.name() + " "), std::string::npos) << words;
  return encoder.name();
}

TEST(FfmpegEncoder, IsNvencIfATrialSucceeds) {
  TemporaryFolder with, without;
  EXPECT_EQ(encoder_chosen(true, with), "h264_nvenc");
  EXPECT_EQ(encoder_chosen(false, without), "libx264");
}

}  // namespace
}  // namespace pf
